// Rows of sheared slices as sources of pixel_rules-inl.hpp, and rays that pass between slices.
// Compiled once a target: see Highway's foreach_target.h.
#if defined(EDGEWISE_SHEAR_ROWS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_SHEAR_ROWS_INL
#undef EDGEWISE_SHEAR_ROWS_INL
#else
#define EDGEWISE_SHEAR_ROWS_INL
#endif

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hwy/highway.h"
#include "transitions/kernels/pixel_rules-inl.hpp"
#include "transitions/kernels/scalar_load.hpp"
#include "transitions/kernels/shear_warp.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {  // other kernels have names of their own in this namespace

/// Pixels of one row of the tile, all four taps inside: two rows of a slice (or twice the
/// outermost), offset so that pixel i reads elements i and i + next. A tap of weight 0 is replaced
/// by its neighbour: beyond the last row or column stands something else, and 0 x infinity is not
/// 0.
template <class T>
struct BilinearRow {
    const T* upper;
    const T* lower;
    std::int64_t next;
    VF right, down;  // weights of the taps to the right and below

    HWY_INLINE VF at(std::int64_t i, std::int64_t) const {
        return between(between(load_row(upper + i), load_row(upper + i + next), right),
                       between(load_row(lower + i), load_row(lower + i + next), right), down);
    }
};

template <class T>
struct NearestRow {
    const T* row;

    HWY_INLINE VF at(std::int64_t i, std::int64_t) const { return load_row(row + i); }
};

/// The outermost column of a slice: pixels beside it see nothing else.
template <class T>
struct EndColumn {
    const T* upper;
    const T* lower;
    VF down;  // weight of the tap below

    HWY_INLINE VF at(std::int64_t, std::int64_t) const {
        return between(hn::Set(DF(), static_cast<float>(*upper)),
                       hn::Set(DF(), static_cast<float>(*lower)), down);
    }
};

/// Pixels in the rounding of a face, or of types without vector loads: one by one.
struct ClampedRow {
    const Grid& volume;
    ScalarLoad load;
    Hold hold;
    std::int64_t slice;
    double x, y;  // of pixel 0 in the slice

    HWY_NOINLINE VF at(std::int64_t i, std::int64_t count) const {
        HWY_ALIGN float values[kLanes] = {};
        const std::int64_t lanes = std::min<std::int64_t>(count, kLanes);
        for (std::int64_t lane = 0; lane < lanes; ++lane)
            values[lane] = value(x + static_cast<double>(i + lane));
        return hn::Load(DF(), values);
    }

 private:
    float value(double at_x) const {
        const Extent& n = volume.extent;
        const double u = std::clamp(at_x, 0.0, static_cast<double>(n.x - 1));
        const double v = std::clamp(y, 0.0, static_cast<double>(n.y - 1));
        if (hold == Hold::zoh) return tap(std::floor(u + 0.5), std::floor(v + 0.5));
        const double i = std::floor(u), j = std::floor(v);
        const float f = static_cast<float>(u - i), g = static_cast<float>(v - j);
        const float upper = mixed(tap(i, j), tap(i + 1, j), f);
        const float lower = mixed(tap(i, j + 1), tap(i + 1, j + 1), f);
        return mixed(upper, lower, g);
    }
    static float mixed(float a, float b, float f) { return f > 0 ? a + f * (b - a) : a; }
    float tap(double i, double j) const {
        const Extent& n = volume.extent;
        const std::int64_t ix = std::min(static_cast<std::int64_t>(i), n.x - 1);
        const std::int64_t iy = std::min(static_cast<std::int64_t>(j), n.y - 1);
        return load(volume.samples, slice * volume.slice_step() + iy * volume.row_step() + ix);
    }
};

/// A pixel in a face of the volume must not be lost to the rounding of its place.
constexpr double kSlip = 1e-9;

/// Whole pixels p with low <= p + offset <= high, cut to [first, width).
struct Range {
    std::int64_t begin, end;

    Range(double low, double high, double offset, std::int64_t first, std::int64_t width)
        : begin(std::clamp<std::int64_t>(static_cast<std::int64_t>(std::ceil(low - offset)), first,
                                         width)),
          end(std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(high - offset)) + 1,
                                       begin, width)) {}
};

/// What is the same for all rows of a slice that a tile sees.
struct Columns {
    double x;            // of pixel 0 in the slice
    Range any, whole;    // pixels over the slice; those for which it counts in full
    Range taps;          // of these whose samples, or both neighbours, are in the slice
    std::int64_t first;  // sample of pixel 0; with first-order hold its left neighbour
    VF right;            // weight of the tap to the right
    std::int64_t next;   // samples from a tap to that on its right

    Columns(const ShearWarp& warp, double slice, std::int64_t i, std::int64_t skip,
            std::int64_t width)
        : x(static_cast<double>(i) + warp.x + slice * warp.dx),
          any(-0.5 - kSlip, last(warp) + kSlip, x, skip, width),
          // Where neighbouring slices count too, a slice counts in full.
          whole(-0.5 + std::abs(warp.dx), last(warp) - std::abs(warp.dx), x, skip, width),
          taps(0, static_cast<double>(warp.volume.extent.x - 1), x, skip, width),
          first(static_cast<std::int64_t>(std::floor(warp.hold == Hold::zoh ? x + 0.5 : x))),
          right(hn::Set(DF(), static_cast<float>(x - static_cast<double>(first)))),
          // Beside the last column, a place that is whole but for its rounding has no right tap.
          next(x - static_cast<double>(first) > kSlip ? 1 : 0) {
        if (warp.hold != Hold::zoh) return;
        taps.begin = std::clamp(-first, any.begin, any.end);
        taps.end = std::clamp(warp.volume.extent.x - first, taps.begin, any.end);
    }

 private:
    static double last(const ShearWarp& warp) {
        return static_cast<double>(warp.volume.extent.x) - 0.5;
    }
};

/// Rays that pass between two slices, or beyond the outermost: the nearest slice stands for all of
/// what is inside, so that every ray that meets the volume has a sample.
struct Slivers {
    const ShearWarp& warp;
    std::int64_t i, j, skip, width, height;
    const PixelSpans& spans;
    const PixelStates& states;

    template <class Rule>
    void run() const {
        const DF d;
        const Rule rule(warp.with);
        for (std::int64_t row = 0; row < height; ++row) {
            const float* low = spans.low + row * spans.pitch;
            const float* high = spans.high + row * spans.pitch;
            for (std::int64_t from = skip; from < width; from += kLanes) {
                const VF a = hn::LoadU(d, low + from), b = hn::LoadU(d, high + from);
                const MF between = hn::And(hn::Lt(a, b), hn::Gt(hn::Ceil(a), b));
                if (hn::AllFalse(d, hn::AndNot(beyond(width - from), between))) continue;
                const std::int64_t to = std::min<std::int64_t>(from + kLanes, width);
                for (std::int64_t pixel = from; pixel < to; ++pixel)
                    if (low[pixel] < high[pixel] && std::ceil(low[pixel]) > high[pixel])
                        add(rule, pixel, row, low[pixel], high[pixel]);
            }
        }
    }

 private:
    template <class Rule>
    void add(const Rule& rule, std::int64_t pixel, std::int64_t row, float low, float high) const {
        const float before = std::floor(low), after = before + 1;
        const float last = static_cast<float>(warp.volume.extent.z - 1);
        const float down = low - before, up = after - high;
        const bool first =
            after > last || (before >= 0 && (warp.backwards ? down < up : down <= up));
        const float nearest = first ? before : after;
        // The span is moved to end in the slice.
        const float length = high - low;
        HWY_ALIGN float begin[kLanes] = {}, end[kLanes] = {};
        begin[0] = first ? nearest : nearest - length;
        end[0] = first ? nearest + length : nearest;
        const double k = static_cast<double>(nearest);
        const ClampedRow clamped{warp.volume,
                                 scalar_load(warp.volume.type),
                                 warp.hold,
                                 static_cast<std::int64_t>(nearest),
                                 static_cast<double>(i + pixel) + warp.x + k * warp.dx,
                                 static_cast<double>(j + row) + warp.y + k * warp.dy};
        add_parts(rule, clamped, 0, 1, nearest, begin, end,
                  states.first + row * states.pitch + pixel, states.plane);
    }
};

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
