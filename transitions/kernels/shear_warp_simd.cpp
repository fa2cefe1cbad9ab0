// Shear-warp: slices are added to an intermediate image, with four constant weights each.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "transitions/kernels/scalar_load.hpp"
#include "transitions/kernels/shear_warp.hpp"
#include "transitions/kernels/shear_warp_max.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/shear_warp_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/pixel_rules-inl.hpp"
#include "transitions/kernels/shear_rows-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// T = void: no vector loads.
template <class T>
struct Tile {
    const ShearWarp& warp;
    std::int64_t i, j, skip, width, height;
    const PixelSpans& spans;
    const PixelStates& states;

    template <class Rule>
    void run() const {
        const Rule rule(warp.with);
        const bool sums = warp.with.rule == Combine::sum || warp.with.rule == Combine::mean;
        const std::int64_t slices = warp.volume.extent.z;
        bool open = false;  // something was added since blocks were closed
        for (std::int64_t n = 0; n < slices; ++n) {
            const std::int64_t slice = warp.backwards ? slices - 1 - n : n;
            const Columns columns(warp, static_cast<double>(slice), i, skip, width);
            const Range rows = rows_of(slice);
            if (columns.any.begin < columns.any.end && rows.begin < rows.end) {
                for (std::int64_t row = rows.begin; row < rows.end; ++row)
                    add_row(rule, columns, slice, row, states.first + row * states.pitch);
                open = true;
            }
            if (!sums || (n + 1) % kBlockPlanes != 0 || !open) continue;
            for (std::int64_t row = 0; row < height; ++row)
                close_block(states.first + row * states.pitch, states.plane, width);
            open = false;
        }
    }

 private:
    double below() const { return static_cast<double>(warp.volume.extent.y) - 0.5; }
    double y_of(std::int64_t slice, std::int64_t row) const {
        return static_cast<double>(j + row) + warp.y + static_cast<double>(slice) * warp.dy;
    }
    /// That may be over a slice.
    Range rows_of(std::int64_t slice) const {
        return {-1.5, below() + 1, y_of(slice, 0), 0, height};
    }

    template <class Rule>
    HWY_INLINE void add_row(const Rule& rule, const Columns& columns, std::int64_t slice,
                            std::int64_t row, float* state) const {
        const double y = y_of(slice, row);
        if (y < -0.5 - kSlip || y > below() + kSlip) return;
        if constexpr (std::is_void_v<T>) {
            clamped(rule, columns, slice, row, y, columns.any.begin, columns.any.end, state);
        } else {
            vectors(rule, columns, slice, row, y, state);
        }
    }
    template <class Rule, class Source>
    HWY_INLINE void parts(const Rule& rule, const Source& source, std::int64_t slice,
                          std::int64_t row, std::int64_t from, std::int64_t to,
                          float* state) const {
        if (from < to)
            add_parts(rule, source, from, to, static_cast<float>(slice),
                      spans.low + row * spans.pitch, spans.high + row * spans.pitch, state,
                      states.plane);
    }
    template <class Rule>
    void clamped(const Rule& rule, const Columns& columns, std::int64_t slice, std::int64_t row,
                 double y, std::int64_t from, std::int64_t to, float* state) const {
        parts(
            rule,
            ClampedRow{warp.volume, scalar_load(warp.volume.type), warp.hold, slice, columns.x, y},
            slice, row, from, to, state);
    }
    template <class Rule>
    HWY_INLINE void vectors(const Rule& rule, const Columns& columns, std::int64_t slice,
                            std::int64_t row, double y, float* state) const {
        const Extent& n = warp.volume.extent;
        const Range &any = columns.any, &taps = columns.taps;
        const double rise = std::abs(warp.dy);
        const bool full = y - rise >= -0.5 && y + rise <= below();
        const auto all = [&](const auto& source) {
            const std::int64_t from = std::clamp(columns.whole.begin, taps.begin, taps.end);
            const std::int64_t to = full ? std::clamp(columns.whole.end, from, taps.end) : from;
            parts(rule, source, slice, row, taps.begin, from, state);
            add_whole(rule, source, from, to, state, states.plane);
            parts(rule, source, slice, row, to, taps.end, state);
        };
        const auto row_of = [&](std::int64_t line) {
            return warp.volume.template row_from<T>(slice * warp.volume.slice_step() +
                                                    line * warp.volume.row_step());
        };
        if (warp.hold == Hold::zoh) {
            const auto line = std::clamp<std::int64_t>(
                static_cast<std::int64_t>(std::floor(y + 0.5)), 0, n.y - 1);
            if (any.begin < taps.begin)
                clamped(rule, columns, slice, row, y, any.begin, taps.begin, state);
            all(NearestRow<T>{row_of(line) + columns.first});
            if (taps.end < any.end) clamped(rule, columns, slice, row, y, taps.end, any.end, state);
            return;
        }
        const double v = std::clamp(y, 0.0, static_cast<double>(n.y - 1)), upper = std::floor(v);
        const auto above = static_cast<std::int64_t>(upper);
        const T* line = row_of(above);
        const T* next = v > upper ? row_of(above + 1) : line;
        const VF down = hn::Set(DF(), static_cast<float>(v - upper));
        parts(rule, EndColumn<T>{line, next, down}, slice, row, any.begin, taps.begin, state);
        all(BilinearRow<T>{line + columns.first, next + columns.first, columns.next, columns.right,
                           down});
        parts(rule, EndColumn<T>{line + n.x - 1, next + n.x - 1, down}, slice, row, taps.end,
              any.end, state);
    }
};

void shear_slivers_on(const ShearWarp& warp, std::int64_t i, std::int64_t j, std::int64_t skip,
                      std::int64_t width, std::int64_t height, const PixelSpans& spans,
                      const PixelStates& states) {
    with_rule<false>(warp.with, Slivers{warp, i, j, skip, width, height, spans, states});
}

void shear_warp_on(const ShearWarp& warp, std::int64_t i, std::int64_t j, std::int64_t skip,
                   std::int64_t width, std::int64_t height, const PixelSpans& spans,
                   const PixelStates& states) {
    const Combining& with = warp.with;
    const auto call = [&]<class T, bool kFinite>() {
        with_rule<kFinite>(with, Tile<T>{warp, i, j, skip, width, height, spans, states});
    };
    switch (warp.volume.type) {
        case Type::u8:
            return call.template operator()<std::uint8_t, true>();
        case Type::i8:
            return call.template operator()<std::int8_t, true>();
        case Type::u16:
            return call.template operator()<std::uint16_t, true>();
        case Type::i16:
            return call.template operator()<std::int16_t, true>();
        case Type::f32:
            return call.template operator()<float, false>();
        default:
            return call.template operator()<void, false>();
    }
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(shear_warp_on);
HWY_EXPORT(shear_slivers_on);

namespace {

/// Cuts from .. to, where a ray is inside along other axes, to where it is so along this one.
void clip(double origin, double slope, std::int64_t count, double& from, double& to) {
    const double first = -0.5, last = static_cast<double>(count) - 0.5;
    if (slope == 0) {
        if (origin < first || origin > last) to = from - 1;
        return;
    }
    const double a = (first - origin) / slope, b = (last - origin) / slope;
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
}

}  // namespace

void shear_warp(const ShearWarp& warp, std::int64_t i, std::int64_t j, std::int64_t width,
                std::int64_t height, const PixelSpans& spans, const PixelStates& states,
                std::int64_t skip) {
    const PixelSpans part_spans{spans.low + skip, spans.high + skip, spans.pitch};
    const PixelStates part{states.first + skip, states.pitch, states.plane};
    if (!shear_warp_max(warp, i + skip, j, width - skip, height, part_spans, part))
        HWY_DYNAMIC_DISPATCH(shear_warp_on)(warp, i, j, skip, width, height, spans, states);
    HWY_DYNAMIC_DISPATCH(shear_slivers_on)(warp, i, j, skip, width, height, spans, states);
}

void shear_spans(const ShearWarp& warp, std::int64_t i, std::int64_t j, std::int64_t width,
                 std::int64_t height, float* low, float* high, std::ptrdiff_t pitch) {
    const Extent& n = warp.volume.extent;
    constexpr std::int64_t kTogether = 128;  // columns
    double begin[kTogether], end[kTogether];
    for (std::int64_t first = 0; first < width; first += kTogether) {
        const std::int64_t columns = std::min(kTogether, width - first);
        for (std::int64_t column = 0; column < columns; ++column) {
            begin[column] = -0.5, end[column] = static_cast<double>(n.z) - 0.5;
            clip(static_cast<double>(i + first + column) + warp.x, warp.dx, n.x, begin[column],
                 end[column]);
        }
        for (std::int64_t row = 0; row < height; ++row) {
            double from = -0.5, to = static_cast<double>(n.z) - 0.5;
            clip(static_cast<double>(j + row) + warp.y, warp.dy, n.y, from, to);
            float* row_low = low + row * pitch + first;
            float* row_high = high + row * pitch + first;
            for (std::int64_t column = 0; column < columns; ++column) {
                row_low[column] = static_cast<float>(std::max(begin[column], from));
                row_high[column] = static_cast<float>(std::min(end[column], to));
            }
        }
    }
}

}  // namespace edgewise::kernels
#endif
