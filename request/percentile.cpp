#include "request/percentile.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "graph/with_type.hpp"

namespace edgewise {
namespace {

constexpr int kBins = 65536;

template <class T>
double ranked(const Data& data, double low, double high, double share) {
    const ValueMap& values = data.what.values;
    // Bins hold one integer each where they can.
    const double step = is_integer(data.what.type) ? std::abs(values.slope) : 0;
    const double width = std::max({step, (high - low) / (kBins - 1), 1e-300});
    std::vector<std::int64_t> bins(kBins);
    std::int64_t total = 0;
    const T* samples = data.as<T>();
    for (std::int64_t i = 0; i < data.what.samples() * data.what.channels; ++i) {
        const double value = values(static_cast<double>(samples[i]));
        if (!std::isfinite(value)) continue;
        // Half a bin on: an integer's own bin is not to hang on rounding.
        const int bin = static_cast<int>((value - low) / width + 0.5);
        ++bins[static_cast<std::size_t>(std::clamp(bin, 0, kBins - 1))];
        ++total;
    }
    const double rank = share * static_cast<double>(total - 1);
    std::size_t bin = 0;
    for (std::int64_t below = bins[0]; bin < kBins - 1 && static_cast<double>(below) <= rank;)
        below += bins[++bin];
    return std::min(high, low + static_cast<double>(bin) * width);
}

}  // namespace

double percentile_of(const Data& data, double low, double high, double share) {
    return with_type(data.what.type,
                     [&](auto zero) { return ranked<decltype(zero)>(data, low, high, share); });
}

}  // namespace edgewise
