#include "transitions/reference/histogram.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "transitions/reference/stored.hpp"

namespace edgewise {
namespace {

/// Bins of stored numbers, before the value map.
struct Bins {
    double low = 0, width = 1;
    int count = 1;

    int of(double stored) const noexcept {
        // The greatest value is the upper end of the last bin.
        return std::clamp(static_cast<int>((stored - low) / width), 0, count - 1);
    }
};

Bins bins_between(double least, double greatest, bool integers) {
    if (!integers) {
        const double width = (greatest - least) / Histogram::kMostBins;
        // One value, or values so close that a bin has no width.
        if (!(width > 0)) return {.low = least, .width = 0, .count = 1};
        return {.low = least, .width = width, .count = Histogram::kMostBins};
    }
    const double levels = greatest - least + 1;
    const double width = std::ceil(levels / Histogram::kMostBins);
    return {
        .low = least - 0.5, .width = width, .count = static_cast<int>(std::ceil(levels / width))};
}

}  // namespace

Histogram histogram_of(const Data& data, const Statistics& statistics) {
    const ValueMap& map = data.what.values;
    const std::int64_t values = data.what.extent.samples() * data.what.channels;
    Histogram histogram;
    histogram.looked_at = std::min(values, Histogram::kMostValues);
    if (statistics.non_finite == values) return histogram;
    // The extremes are known to be real, so their stored numbers are found again.
    const double ends[] = {(statistics.low - map.offset) / map.slope,
                           (statistics.high - map.offset) / map.slope};
    double least = std::min(ends[0], ends[1]), greatest = std::max(ends[0], ends[1]);
    const bool integers = is_integer(data.what.type);
    if (integers) {
        least = std::round(least);
        greatest = std::round(greatest);
    }
    const Bins bins = bins_between(least, greatest, integers);
    histogram.counts.assign(static_cast<std::size_t>(bins.count), 0);
    const bool all = values <= Histogram::kMostValues;
    const double stretch = static_cast<double>(values) / static_cast<double>(histogram.looked_at);
    with_stored_type(data.what.type, [&](auto zero) {
        const auto* stored = data.as<decltype(zero)>();
        std::mt19937_64 bits(18);
        for (std::int64_t i = 0; i < histogram.looked_at; ++i) {
            const double within = all ? 0 : static_cast<double>(bits() >> 11) * 0x1p-53;
            const auto at = static_cast<std::int64_t>((static_cast<double>(i) + within) * stretch);
            const double value = as_double(stored[std::min(at, values - 1)]);
            if (!std::isfinite(value)) continue;
            const int bin = bins.width > 0 ? bins.of(value) : 0;
            ++histogram.counts[static_cast<std::size_t>(bin)];
        }
    });
    histogram.low = map(bins.low);
    histogram.high = map(bins.low + bins.width * bins.count);
    if (map.slope < 0) {
        std::swap(histogram.low, histogram.high);
        std::reverse(histogram.counts.begin(), histogram.counts.end());
    }
    return histogram;
}

}  // namespace edgewise
