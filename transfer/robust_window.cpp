#include "transfer/robust_window.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace edgewise {
namespace {

/// Where the largest peak ends on its right: the bin that is farthest below the line from the peak
/// to the last bin. Nothing where the peak is in the upper half.
std::optional<double> foot_of_peak(const std::vector<float>& values, double low, double high) {
    constexpr int kBins = 256;
    std::array<double, kBins> counts{};
    const double width = (high - low) / kBins;
    for (const float value : values)
        if (value <= high)
            ++counts[static_cast<std::size_t>(
                std::clamp(static_cast<int>((value - low) / width), 0, kBins - 1))];
    const auto peak = std::max_element(counts.begin(), counts.end()) - counts.begin();
    if (peak >= kBins / 2) return std::nullopt;
    const double top = counts[static_cast<std::size_t>(peak)];
    double farthest = 0;
    std::ptrdiff_t foot = peak;
    for (std::ptrdiff_t bin = peak; bin < kBins; ++bin) {
        const double line =
            top * static_cast<double>(kBins - 1 - bin) / static_cast<double>(kBins - 1 - peak);
        const double below = line - counts[static_cast<std::size_t>(bin)];
        if (below > farthest) farthest = below, foot = bin;
    }
    return low + width * static_cast<double>(foot);
}

}  // namespace

ValueWindow robust_window(const Drawn& inside, const Statistics& statistics) {
    constexpr double kTop = 0.995, kOutliers = 0.998;
    const ValueWindow all{statistics.low, statistics.high};
    std::vector<float> values(inside.values().begin(), inside.values().end());
    std::erase_if(values, [](float value) { return !std::isfinite(value); });
    if (values.empty()) return all;
    double low = statistics.low;
    if (statistics.occupied_fraction < 0.5) {
        low = statistics.commonest;
    } else if (const double high = quantile_of(values, kOutliers); high > low) {
        low = foot_of_peak(values, low, high).value_or(low);
    }
    std::erase_if(values, [&](float value) { return !(value > low); });
    if (values.empty()) return all;
    const double high = quantile_of(values, kTop);
    return high > low ? ValueWindow{low, high} : all;
}

std::optional<double> hounsfield_shift(const Drawn& everywhere, const Statistics& statistics) {
    const std::span<const float> values = everywhere.values();
    if (values.empty()) return std::nullopt;
    // Counts of steps of 25 from -1100 on: all bounds below are multiples.
    constexpr int kStep = 25, kFirst = -1100, kBins = 140;
    std::array<std::int64_t, kBins> counts{};
    for (const float value : values) {
        const double bin = std::floor((value - kFirst) / kStep);
        if (bin >= 0 && bin < kBins) ++counts[static_cast<std::size_t>(bin)];
    }
    const auto share = [&](int low, int high) {
        const auto from = counts.begin() + (low - kFirst) / kStep;
        const auto to = counts.begin() + (high - kFirst) / kStep;
        return static_cast<double>(std::accumulate(from, to, std::int64_t{0})) /
               static_cast<double>(values.size());
    };
    constexpr double kSome = 0.005, kNarrow = 3, kPeak = 1.5;
    if (statistics.low <= -850) {
        // Between lungs and fat there are but the samples that lie half in one and half in another.
        const double between = share(-650, -350);
        const double air = share(-1100, -800), tissue = share(-150, 200);
        return share(-1100, -850) > kSome && tissue > kSome && air > kPeak * between &&
                       tissue > kPeak * between
                   ? std::optional(0.0)
                   : std::nullopt;
    }
    constexpr double kShift = 1024, kFewBetween = 0.35;
    // Soft tissue and water are a narrow peak far above air; fat, lungs and bone are not as common.
    const double tissue = share(950, 1150);
    if (statistics.low >= 0 && statistics.high > kShift + 200 && share(0, 175) > kSome &&
        tissue > kSome && tissue > kNarrow * share(525, 725) &&
        share(300, 850) < kFewBetween * share(925, 1200))
        return -kShift;
    return std::nullopt;
}

Glance glance_at(const Data& data, const Statistics& statistics) {
    constexpr std::int64_t kRuns = 1 << 10, kLength = 32;
    constexpr std::int64_t kRunsOfSparse = 1 << 12, kLengthOfSparse = 128;
    constexpr double kSparse = 0.05;
    const Region all = Region::all(data.what.extent);
    const bool sparse = statistics.occupied_fraction < kSparse;
    const Drawn everywhere(data, all, kRuns, kLength);
    Glance glance{.everywhere = everywhere,
                  .inside = sparse ? Drawn(data, statistics.occupied, kRunsOfSparse,
                                           kLengthOfSparse, &statistics.commonest)
                            : statistics.occupied == all
                                ? everywhere
                                : Drawn(data, statistics.occupied, kRuns, kLength)};
    glance.window = robust_window(glance.inside, statistics);
    glance.hounsfield = hounsfield_shift(glance.everywhere, statistics);
    return glance;
}

}  // namespace edgewise
