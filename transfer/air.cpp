#include "transfer/air.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "graph/with_type.hpp"

namespace edgewise {
namespace {

/// The least value above another one; infinite: none.
double least_above(const Data& data, std::span<const store::PaddingRuns::Run> padding,
                   double above) {
    double least = std::numeric_limits<double>::infinity();
    const std::int64_t channels = data.what.channels;
    with_type(data.what.type, [&](auto zero) {
        const auto* stored = data.as<decltype(zero)>();
        const auto look = [&](std::int64_t begin, std::int64_t end) {
            for (std::int64_t i = begin * channels; i < end * channels; ++i) {
                const double value = data.what.values(static_cast<double>(stored[i]));
                if (value > above && value < least) least = value;
            }
        };
        std::int64_t begin = 0;
        const std::int64_t samples = data.what.samples();
        for (const store::PaddingRuns::Run& run : padding) {
            look(begin, std::min(run.first, samples));
            begin = run.first + run.count;
        }
        look(begin, samples);
    });
    return least;
}

}  // namespace

std::optional<double> air_of(const Data& data, std::span<const store::PaddingRuns::Run> padding) {
    constexpr double kMeasured = -1024;  // of 12 bits that go down to it
    constexpr double kAlone = 100;       // far more than the noise of air differs by
    double least = least_above(data, padding, -std::numeric_limits<double>::infinity());
    while (least < kMeasured) {
        const double next = least_above(data, padding, least);
        if (!std::isfinite(next) || next - least <= kAlone) break;
        least = next;
    }
    return std::isfinite(least) ? std::optional(least) : std::nullopt;
}

}  // namespace edgewise
