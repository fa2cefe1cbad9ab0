#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace edgewise::kernels {

/// Columns of a row, begin <= x < end.
struct Columns {
    std::int64_t begin = 0, end = 0;
};

/// The columns of `within` where low <= start + x * step <= high, evaluated in just this way. They
/// do not depend on how rows are cut.
inline Columns columns_between(double start, double step, double low, double high,
                               Columns within) noexcept {
    const auto seen = [&](std::int64_t x) {
        const double at = start + double(x) * step;
        return low <= at && at <= high;
    };
    if (within.end <= within.begin) return {within.begin, within.begin};
    const double from = double(within.begin), to = double(within.end - 1);
    // A step that moves a whole row by less than a rounding error decides nothing.
    if (std::abs(step) * (std::abs(from) + std::abs(to) + 1) < 1e-12)
        return seen(within.begin) ? within : Columns{within.begin, within.begin};
    const double one = (low - start) / step, other = (high - start) / step;
    auto first = std::int64_t(std::clamp(std::ceil(std::min(one, other)), from, to));
    auto last = std::int64_t(std::clamp(std::floor(std::max(one, other)), from, to));
    // The quotients are rounded; the definition decides at the ends.
    while (first > within.begin && seen(first - 1)) --first;
    while (first <= last && !seen(first)) ++first;
    while (last + 1 < within.end && seen(last + 1)) ++last;
    while (last >= first && !seen(last)) --last;
    return {first, std::max(last + 1, first)};
}

}  // namespace edgewise::kernels
