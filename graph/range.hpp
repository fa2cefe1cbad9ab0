#pragma once

#include <algorithm>
#include <cmath>

namespace edgewise {

/// The difference in values that counts as an error of 1, between the least and the largest value:
/// their distance; of a constant its magnitude, or 1 where that is 0.
///
/// Sums round, and so what ought to be constant is not quite: it is one where the distance is less
/// than f32 can tell from rounding. A sample is rounded by half of 2^-24 of its magnitude, the
/// weights of a spline's prefilter add up to 3 along each axis without their signs, 27 in a volume,
/// and its sums round about as often again: 64 roundings.
/// @param magnitude  of numbers that cancelled before, whose rounding is still there
inline double range_between(double low, double high, double magnitude = 0) noexcept {
    constexpr double kRounding = 64 * 0x1p-24;
    if (!(low <= high)) return 1;
    const double largest = std::max(std::abs(low), std::abs(high));
    if (high - low > kRounding * std::max(largest, magnitude)) return high - low;
    return largest > kRounding * magnitude ? largest : 1;
}

}  // namespace edgewise
