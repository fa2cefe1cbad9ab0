// Shear-warp by runs: of slices what may be seen is added to pixels that are not opaque.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "transitions/kernels/shear_warp_runs.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/shear_warp_runs_simd.cpp"
#include "hwy/cache_control.h"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/open_blocks-inl.hpp"
#include "transitions/kernels/shear_rows-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

static_assert(kRunsWidth <= kOpenWidth);

/// T = void: no vector loads.
template <class T>
struct RunsTile {
    const ShearWarp& warp;
    const VisibleRuns& runs;
    std::int64_t i, j, width, height;
    const PixelSpans& spans;
    const PixelStates& states;

    template <class Rule>
    void run() const {
        const Rule rule(warp.with);
        std::array<OpenBlocks, kRunsHeight> open;
        open.fill(OpenBlocks(width));
        const std::int64_t slices = warp.volume.extent.z;
        for (std::int64_t n = 0; n < slices; ++n) {
            const std::int64_t slice = warp.backwards ? slices - 1 - n : n;
            const Range rows = rows_of(slice);
            if (rows.begin >= rows.end) continue;
            const Columns columns(warp, static_cast<double>(slice), i, 0, width);
            if (columns.any.begin >= columns.any.end) continue;
            for (std::int64_t row = rows.begin; row < rows.end; ++row)
                if (open[row].any()) add_row(rule, columns, slice, row, open[row]);
            if (kEnds<Rule> && all_closed(open)) return;
        }
    }

 private:
    /// What a row of the image sees of a slice, and which of its pixels are open.
    template <class Rule>
    struct Row {
        const Rule& rule;
        const Columns& columns;
        std::int64_t slice, row;
        double y;
        OpenBlocks& open;
        float* state;
    };

    bool all_closed(const std::array<OpenBlocks, kRunsHeight>& open) const {
        return std::none_of(open.begin(), open.begin() + height,
                            [](const OpenBlocks& row) { return row.any(); });
    }
    double below() const { return static_cast<double>(warp.volume.extent.y) - 0.5; }
    double y_of(std::int64_t slice, std::int64_t row) const {
        return static_cast<double>(j + row) + warp.y + static_cast<double>(slice) * warp.dy;
    }
    /// That may be over rows of a slice which have runs.
    Range rows_of(std::int64_t slice) const {
        const VisibleRuns::Slice& seen = runs.slices[static_cast<std::size_t>(slice)];
        if (seen.first >= seen.last) return {0, -1, 0, 0, 0};
        const double low = static_cast<double>(seen.first) - 1.5;
        const double high = static_cast<double>(seen.last) + 0.5;
        return {low, high, y_of(slice, 0), 0, height};
    }

    template <class Rule>
    HWY_INLINE void add_row(const Rule& rule, const Columns& columns, std::int64_t slice,
                            std::int64_t row, OpenBlocks& open) const {
        const double y = y_of(slice, row);
        if (y < -0.5 - kSlip || y > below() + kSlip) return;
        const Extent& n = warp.volume.extent;
        const auto last = static_cast<double>(n.y - 1);
        // The line that the rows of samples below read, or that of which they read the upper one.
        const double line = warp.hold == Hold::zoh ? std::floor(y + 0.5) : std::floor(y);
        const auto seen = runs.row(static_cast<std::int64_t>(std::clamp(line, 0.0, last)), slice);
        const std::int64_t behind = warp.backwards ? slice - 1 : slice + 1;
        if (behind >= 0 && behind < warp.volume.extent.z)
            fetch(columns, behind, static_cast<std::int64_t>(std::clamp(line, 0.0, last)), open);
        const Row<Rule> at{rule, columns, slice, row, y, open, states.first + row * states.pitch};
        const Range& any = columns.any;
        for (const VisibleRuns::Run& run : seen) {
            // Beside the outermost cells they continue.
            const std::int64_t from =
                run.begin == 0 ? any.begin : std::max(any.begin, run.begin - columns.first);
            const std::int64_t to =
                run.end == n.x ? any.end : std::min(any.end, run.end - columns.first);
            if (from >= any.end) return;
            if (from >= to) continue;
            if constexpr (std::is_void_v<T>) {
                clamped(at, from, to);
            } else {
                vectors(at, from, to);
            }
        }
    }
    /// Asks for what a row will read of the next slice: of short runs no processor foresees that.
    /// It lies less than a sample beside what it reads here.
    HWY_INLINE void fetch(const Columns& columns, std::int64_t slice, std::int64_t line,
                          const OpenBlocks& open) const {
        if constexpr (!std::is_void_v<T>) {
            constexpr std::int64_t kApart = 64 / sizeof(T);
            const Grid& volume = warp.volume;
            // Places may lie beside the array: they are numbers, not pointers.
            const auto first =
                reinterpret_cast<std::uintptr_t>(volume.samples) +
                sizeof(T) * static_cast<std::uintptr_t>(slice * volume.slice_step() +
                                                        line * volume.row_step() + columns.first);
            for (const VisibleRuns::Run& run : runs.row(line, slice))
                open.each(std::max<std::int64_t>(run.begin - columns.first, 0),
                          std::min(run.end - columns.first, width),
                          [&](std::int64_t begin, std::int64_t end) {
                              for (std::int64_t p = begin; p < end; p += kApart)
                                  hwy::Prefetch(reinterpret_cast<const T*>(
                                      first + sizeof(T) * static_cast<std::uintptr_t>(p)));
                          });
        }
    }
    template <class Rule, class Source>
    HWY_INLINE void whole(const Row<Rule>& at, const Source& source, std::int64_t from,
                          std::int64_t to) const {
        at.open.each(from, to, [&](std::int64_t begin, std::int64_t end) HWY_ATTR {
            add_whole(at.rule, source, begin, end, at.state, states.plane);
            closes(at, begin, end);
        });
    }
    template <class Rule, class Source>
    HWY_INLINE void parts(const Row<Rule>& at, const Source& source, std::int64_t from,
                          std::int64_t to) const {
        at.open.each(from, to, [&](std::int64_t begin, std::int64_t end) HWY_ATTR {
            add_parts(at.rule, source, begin, end, static_cast<float>(at.slice),
                      spans.low + at.row * spans.pitch, spans.high + at.row * spans.pitch, at.state,
                      states.plane);
            closes(at, begin, end);
        });
    }
    template <class Rule>
    HWY_INLINE void closes(const Row<Rule>& at, std::int64_t from, std::int64_t to) const {
        if constexpr (kEnds<Rule>) at.open.close(from, to, at.state + 3 * states.plane);
    }
    template <class Rule>
    void clamped(const Row<Rule>& at, std::int64_t from, std::int64_t to) const {
        parts(at,
              ClampedRow{warp.volume, scalar_load(warp.volume.type), warp.hold, at.slice,
                         at.columns.x, at.y},
              from, to);
    }
    /// As Tile::vectors of shear_warp_simd.cpp, of pixels [begin, end).
    template <class Rule>
    HWY_INLINE void vectors(const Row<Rule>& at, std::int64_t begin, std::int64_t end) const {
        const Columns& columns = at.columns;
        const Extent& n = warp.volume.extent;
        const double rise = std::abs(warp.dy), y = at.y;
        const bool full = y - rise >= -0.5 && y + rise <= below();
        const std::int64_t inner = std::clamp(columns.taps.begin, begin, end);
        const std::int64_t outer = std::clamp(columns.taps.end, inner, end);
        const auto all = [&](const auto& source) HWY_ATTR {
            const std::int64_t from = std::clamp(columns.whole.begin, inner, outer);
            const std::int64_t to = full ? std::clamp(columns.whole.end, from, outer) : from;
            parts(at, source, inner, from);
            whole(at, source, from, to);
            parts(at, source, to, outer);
        };
        const auto row_of = [&](std::int64_t line) {
            return warp.volume.template row_from<T>(at.slice * warp.volume.slice_step() +
                                                    line * warp.volume.row_step());
        };
        if (warp.hold == Hold::zoh) {
            const auto line = std::clamp<std::int64_t>(
                static_cast<std::int64_t>(std::floor(y + 0.5)), 0, n.y - 1);
            if (begin < inner) clamped(at, begin, inner);
            all(NearestRow<T>{row_of(line) + columns.first});
            if (outer < end) clamped(at, outer, end);
            return;
        }
        const double v = std::clamp(y, 0.0, static_cast<double>(n.y - 1)), upper = std::floor(v);
        const auto above = static_cast<std::int64_t>(upper);
        const T* line = row_of(above);
        const T* next = v > upper ? row_of(above + 1) : line;
        const VF down = hn::Set(DF(), static_cast<float>(v - upper));
        parts(at, EndColumn<T>{line, next, down}, begin, inner);
        all(BilinearRow<T>{line + columns.first, next + columns.first, columns.next, columns.right,
                           down});
        parts(at, EndColumn<T>{line + n.x - 1, next + n.x - 1, down}, outer, end);
    }
};

void shear_warp_runs_on(const ShearWarp& warp, const VisibleRuns& runs, std::int64_t i,
                        std::int64_t j, std::int64_t width, std::int64_t height,
                        const PixelSpans& spans, const PixelStates& states) {
    const auto call = [&]<class T, bool kFinite>() {
        with_seen_rule<kFinite>(warp.with,
                                RunsTile<T>{warp, runs, i, j, width, height, spans, states});
    };
    switch (warp.volume.type) {
        case Type::u8:
            call.template operator()<std::uint8_t, true>();
            break;
        case Type::i8:
            call.template operator()<std::int8_t, true>();
            break;
        case Type::u16:
            call.template operator()<std::uint16_t, true>();
            break;
        case Type::i16:
            call.template operator()<std::int16_t, true>();
            break;
        case Type::f32:
            call.template operator()<float, false>();
            break;
        default:
            call.template operator()<void, false>();
    }
    with_seen_rule<false>(warp.with, Slivers{warp, i, j, 0, width, height, spans, states});
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(shear_warp_runs_on);

void shear_warp_runs(const ShearWarp& warp, const VisibleRuns& runs, std::int64_t i, std::int64_t j,
                     std::int64_t width, std::int64_t height, const PixelSpans& spans,
                     const PixelStates& states) {
    HWY_DYNAMIC_DISPATCH(shear_warp_runs_on)
    (warp, runs, i, j, width, height, spans, states);
}

}  // namespace edgewise::kernels
#endif
