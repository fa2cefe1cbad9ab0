#pragma once

#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/transfer_sums.hpp"

namespace edgewise::kernels {

// Combine::over without light, by other quadratures than the midpoint rule. A ray is cut into
// pieces: from where it enters to the middle of its first cell, from each cell's middle to the
// next, and from the last one to where it leaves. Pieces with an end that is not finite are left
// out. All else is as ray_cast() has it.

/// The trapezoidal rule: the optical depth of a piece is the mean of both ends times its length.
/// Its colour is the mean of both ends, weighted by their optical depths.
void ray_cast_trapezoid(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                        std::int64_t height, float* out, std::ptrdiff_t row_floats);

/// Pieces along which the value is a quadratic through both ends and the middle, and the colour
/// goes evenly with the optical depth.
///
/// A half of a piece has the quadratic's values at its ends and its middle. Its optical depth is
/// integrated along one chord, and along the two chords of its halves; what is left of the error
/// goes with the square of a chord's length, so a third of the difference is added (Richardson
/// 1911), at most half of the depth. Light within a half piece is attenuated by what of it lies
/// before: to that end colours go evenly with the optical depth, through the means of both halves.
/// @param cast  bricks: with levels of opacities that reach beyond_quadratic()
/// @param sums  of cast.optics
void ray_cast_quadratic(const RayCast& cast, const TransferSums& sums, std::int64_t x,
                        std::int64_t y, std::int64_t width, std::int64_t height, float* out,
                        std::ptrdiff_t row_floats);

/// How far a quadratic's values may lie beyond samples: of three that lie in a range, a quarter of
/// the way from an end, an eighth of the range.
inline Overshoot beyond_quadratic(const Overshoot& filter) noexcept {
    constexpr double kRoundings = 1e-6;
    return {.range = filter.range + (1 + 2 * filter.range) / 8,
            .magnitude = 1.25 * filter.magnitude + kRoundings};
}

}  // namespace edgewise::kernels
