#include "engine/transfer/robust_window.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "reference/preview_block.hpp"
#include "reference/stored.hpp"

namespace edgewise {
namespace {

/// The value below which a share of some values lies; changes their order.
double quantile(std::vector<float>& values, double share) {
    const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    return values[static_cast<std::size_t>(rank)];
}

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

std::vector<float> drawn_values(const Data& data, const Region& region, double occupied_fraction) {
    constexpr std::int64_t kUsual = 1 << 18, kOfSparse = 1 << 21;
    constexpr double kSparse = 0.05;
    std::vector<float> values;
    if (!data.samples.data() || region.empty()) return values;
    const Extent size = region.extent();
    const std::int64_t count = size.samples();
    const std::int64_t drawn = std::min(count, occupied_fraction < kSparse ? kOfSparse : kUsual);
    const double stretch = static_cast<double>(count) / static_cast<double>(drawn);
    const Extent& n = data.what.extent;
    const std::int64_t channels = data.what.channels;
    values.reserve(static_cast<std::size_t>(drawn));
    with_stored_type(data.what.type, [&](auto zero) {
        const auto* stored = data.as<decltype(zero)>();
        for (std::int64_t i = 0; i < drawn; ++i) {
            const double within = drawn == count ? 0 : hashed(static_cast<std::uint64_t>(i));
            const std::int64_t at = std::min(
                count - 1, static_cast<std::int64_t>((static_cast<double>(i) + within) * stretch));
            const std::int64_t x = region.begin[0] + at % size.x,
                               y = region.begin[1] + at / size.x % size.y,
                               z = region.begin[2] + at / (size.x * size.y);
            const auto value = static_cast<float>(
                data.what.values(as_double(stored[channels * (x + n.x * (y + n.y * z))])));
            if (std::isfinite(value)) values.push_back(value);
        }
    });
    return values;
}

ValueWindow robust_window(const Data& data, const Statistics& statistics) {
    constexpr double kTop = 0.995, kOutliers = 0.999;
    const ValueWindow all{statistics.low, statistics.high};
    std::vector<float> values =
        drawn_values(data, statistics.occupied, statistics.occupied_fraction);
    if (values.empty()) return all;
    double low = statistics.low;
    if (statistics.occupied_fraction < 0.5) {
        low = statistics.commonest;
    } else if (const double high = quantile(values, kOutliers); high > low) {
        low = foot_of_peak(values, low, high).value_or(low);
    }
    std::erase_if(values, [&](float value) { return !(value > low); });
    if (values.empty()) return all;
    const double high = quantile(values, kTop);
    return high > low ? ValueWindow{low, high} : all;
}

std::optional<double> hounsfield_shift(const Data& data, const Statistics& statistics) {
    const std::vector<float> values = drawn_values(data, Region::all(data.what.extent), 1);
    if (values.empty()) return std::nullopt;
    const auto share = [&](double low, double high) {
        const auto inside = std::count_if(values.begin(), values.end(),
                                          [&](float v) { return v >= low && v <= high; });
        return static_cast<double>(inside) / static_cast<double>(values.size());
    };
    constexpr double kSome = 0.005;
    if (statistics.low <= -850)
        return share(-1100, -850) > kSome && share(-150, 200) > kSome ? std::optional(0.0)
                                                                      : std::nullopt;
    constexpr double kShift = 1024, kNarrow = 3;
    // Soft tissue and water are a narrow peak far above air; fat, lungs and bone are not as common.
    const double tissue = share(kShift - 75, kShift + 125);
    if (statistics.low >= 0 && statistics.high > kShift + 200 && share(0, kShift - 850) > kSome &&
        tissue > kSome && tissue > kNarrow * share(kShift - 500, kShift - 300))
        return -kShift;
    return std::nullopt;
}

}  // namespace edgewise
