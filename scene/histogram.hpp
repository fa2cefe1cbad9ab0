#pragma once

#include <cstdint>
#include <vector>

#include "graph/data.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// How often values occur: bins of equal width from `low` to `high`, of finite values.
struct Histogram {
    double low = 0, high = 0;  // the outer ends of the outermost bins [value]
    std::vector<std::int64_t> counts;
    std::int64_t looked_at = 0;  // values, at most kMostValues; those that are not finite included

    static constexpr std::int64_t kMostValues = 1 << 18;
    static constexpr int kMostBins = 256;
};

/// All values where these are few, else one from each of kMostValues stretches of equal length, the
/// same ones for the same extent. Integers fill bins of whole numbers, as many for each, so that no
/// bin is fuller than its neighbours for its width: a bin reaches half a step beyond its numbers.
/// Floats: 256 bins between the least and the greatest value. No finite value: no bin.
Histogram histogram_of(const Data& data, const Statistics& statistics);

}  // namespace edgewise
