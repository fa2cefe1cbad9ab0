#include "scene/histogram.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tbb/parallel_for.h>

#include "reference/stored.hpp"

namespace edgewise {
namespace {

constexpr std::int64_t kParts = 16;

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

/// A number in [0, 1) that is as good as random; of neighbours too (splitmix64, Steele et al.
/// 2014).
double scattered(std::int64_t i) noexcept {
    std::uint64_t bits = static_cast<std::uint64_t>(i) * 0x9e3779b97f4a7c15ull + 18;
    bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9ull;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebull;
    return static_cast<double>((bits ^ (bits >> 31)) >> 11) * 0x1p-53;
}

template <class T>
std::vector<std::int64_t> counted(const T* stored, std::int64_t values, std::int64_t looked_at,
                                  const Bins& bins) {
    const bool all = looked_at == values;
    const double stretch = static_cast<double>(values) / static_cast<double>(looked_at);
    std::vector<std::vector<std::int64_t>> parts(
        kParts, std::vector<std::int64_t>(static_cast<std::size_t>(bins.count)));
    tbb::parallel_for(std::int64_t{0}, kParts, [&](std::int64_t part) {
        auto& counts = parts[static_cast<std::size_t>(part)];
        const std::int64_t end = looked_at * (part + 1) / kParts;
        for (std::int64_t i = looked_at * part / kParts; i < end; ++i) {
            const double within = all ? 0 : scattered(i);
            const auto at = static_cast<std::int64_t>((static_cast<double>(i) + within) * stretch);
            const double value = as_double(stored[std::min(at, values - 1)]);
            if (!std::isfinite(value)) continue;
            ++counts[static_cast<std::size_t>(bins.width > 0 ? bins.of(value) : 0)];
        }
    });
    std::vector<std::int64_t> sum(static_cast<std::size_t>(bins.count));
    for (const auto& counts : parts)
        for (std::size_t bin = 0; bin < sum.size(); ++bin) sum[bin] += counts[bin];
    return sum;
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
    histogram.counts = with_stored_type(data.what.type, [&](auto zero) {
        return counted(data.as<decltype(zero)>(), values, histogram.looked_at, bins);
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
