#pragma once

#include <vector>

#include "planner/levels.hpp"

namespace edgewise {

/// Median of rounds, of which less than half may be off by any amount.
struct Settled {
    double value = 0;
    double spread = 0;  // of its log: standard error, from distances to the median
};
Settled settled(const std::vector<double>& rounds);

/// What was measured in a set of one size, a number a round.
struct SetTimes {
    double bytes = 0;
    std::vector<double> streamed, gather, line;  // [s/byte], [s], [s]
};

/// Levels of memory from sets of growing size: medians; where they fall as sets grow, the geometric
/// mean of those that do (isotonic regression of the logarithms); and sizes whose costs are alike
/// are one level, which holds the largest of them.
Levels levels_from(const std::vector<SetTimes>& sets);

}  // namespace edgewise
