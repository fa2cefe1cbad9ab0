#pragma once

#include <vector>

namespace edgewise {

/// Seconds of one path from several of its runs, between which other paths ran: the 0.2 quantile.
/// Other programs, and other guests of a host, make runs longer and never shorter. NaN of none.
double undisturbed(const std::vector<double>& seconds);

/// Standard deviation of the log of undisturbed(), from the distances of runs to their median.
double spread_of_runs(const std::vector<double>& seconds);

/// Whether a path must run once without being counted after another path ran, which emptied the
/// caches. A longer run fills them itself. @param expected  [s] of a run
bool needs_warming(double expected) noexcept;

}  // namespace edgewise
