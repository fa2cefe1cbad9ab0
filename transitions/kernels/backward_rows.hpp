#pragma once

// Geometry of output rows that every target of the backward warp shares: plain f64, no vectors.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "transitions/kernels/backward.hpp"

namespace edgewise::kernels {

inline constexpr double kBorderSlack = 1e-9;  // of a sample; absorbs the rounding of f64 positions
// Lanes round positions to 2^-23 and may land on the other side of a cell's face; closer to the
// faces than this the path with clamped taps is taken.
inline constexpr double kFaceMargin = 1e-6;
inline constexpr double kFixedOne = 1099511627776.0;  // 2^40
inline constexpr int kBlock = kBackwardBlock;         // they share one fixed-point origin
inline constexpr int kChunk = 64;                     // columns that share one f64 origin

/// Columns begin <= x < end.
struct Span {
    std::int64_t begin = 0, end = 0;

    bool holds(std::int64_t first, std::int64_t last) const {
        return begin <= first && last <= end;
    }
};

/// Positions along an axis that belong to the input, and those whose taps need no border rule.
struct Range {
    double low, high;
};

inline Range seen_range(std::int64_t n) {
    return {-0.5 - kBorderSlack, double(n) - 0.5 + kBorderSlack};
}

inline Range inner_range(std::int64_t n, const BackwardPlan& plan) {
    const double last = double(n - 1);
    if (plan.hold == Hold::zoh) return {-0.5 + kFaceMargin, last + 0.5 - kFaceMargin};
    return {plan.below + kFaceMargin, last - plan.below - kFaceMargin};
}

/// Whether a whole region lies inside the ranges, outside the input, or across a border.
enum class Sight { inner, mixed, outside };

inline Sight sight_of(const BackwardPlan& plan, const Region& region) {
    bool inner = true;
    for (int a = 0; a < plan.axes; ++a) {
        const double* m = &plan.map[4 * a];
        double low = m[3], high = m[3];
        for (int k = 0; k < 3; ++k) {
            const double p = m[k] * double(region.begin[k]), q = m[k] * double(region.end[k] - 1);
            low += std::min(p, q);
            high += std::max(p, q);
        }
        const Range seen = seen_range(plan.extent[a]);
        // The sums above and the rows below round differently; only a clear miss counts.
        if (high < seen.low - kFaceMargin || low > seen.high + kFaceMargin) return Sight::outside;
        const Range taps = inner_range(plan.extent[a], plan);
        if (low < taps.low + kFaceMargin || high > taps.high - kFaceMargin) inner = false;
    }
    return inner ? Sight::inner : Sight::mixed;
}

/// First number of the output row (y, z), as if column 0 were held.
inline float* row_of(const BackwardPlan& plan, const WarpOutput& output, std::int64_t y,
                     std::int64_t z) {
    const Extent held = output.held.extent();
    const std::int64_t row = (z - output.held.begin[2]) * held.y + (y - output.held.begin[1]);
    return output.samples + (row * held.x - output.held.begin[0]) * plan.input.channels;
}

inline void fill_columns(const BackwardPlan& plan, float* row, std::int64_t begin,
                         std::int64_t end) {
    if (end > begin)
        std::fill(row + begin * plan.input.channels, row + end * plan.input.channels, plan.outside);
}

/// Asks for the lines of columns that will be written soon: a tile's short rows lie too far from
/// each other for the processor to see them coming.
inline void prefetch_columns(const BackwardPlan& plan, const float* row, Span columns) {
    constexpr std::int64_t kFloats = 16;  // of a line
    const float* const end = row + columns.end * plan.input.channels;
    for (const float* at = row + columns.begin * plan.input.channels; at < end; at += kFloats)
        __builtin_prefetch(at, 1);
    __builtin_prefetch(end - 1, 1);
}

// One function a file of vector code.
void backward_2d_simd(const BackwardPlan&, const WarpOutput&, const Region&) noexcept;
void backward_3d_simd(const BackwardPlan&, const WarpOutput&, const Region&) noexcept;
void backward_weighted_simd(const BackwardPlan&, const WarpOutput&, const Region&) noexcept;
/// The path without vectors.
void backward_in_f64(const BackwardPlan&, const WarpOutput&, const Region&) noexcept;

}  // namespace edgewise::kernels
