#pragma once

#include <vector>

namespace edgewise::cli {

/// What runs of one thing take [s], where they lie apart in time, among runs of other things: the
/// 0.2 quantile, since other programs and other guests of a host only add. Not a number of none.
double undisturbed(const std::vector<double>& seconds);

/// Standard deviation of the log of undisturbed(): from the distances of runs to their median.
double spread_of_runs(const std::vector<double>& seconds);

/// Whether a run that something else ran before goes uncounted, since that took its place in the
/// caches. What takes longer fills them itself. @param expected  [s] of a run
bool needs_warming(double expected) noexcept;

}  // namespace edgewise::cli
