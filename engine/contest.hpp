#pragma once

#include <optional>
#include <vector>

#include "planner/planner.hpp"

namespace edgewise {

struct Planned;

/// What a few draws decide.
struct Contest {
    std::optional<Plan> winner;  // faster than the sure one, and as good as asked for
    double seconds = 0;          // that drawing took
};

/// Draws errors where that pays: of the paths that are faster than one which is surely as good as
/// asked for, the fastest that is as good too.
///
/// Only facts that tell these paths from the plain one are measured, on an eighth of the usual
/// draws first. The ratio of two errors on the same draws spreads less than either, and how far is
/// told by leaving out one group of the draws after the other (jackknife: Efron, Stein 1981). A
/// path is taken if its ratio is within the limit by two standard errors, and dropped if it is
/// beyond by one; of few draws it is no less than a bound, as those that decide may be missing.
/// Where that leaves the fastest open, more is drawn. No preview is drawn that is
/// expected to cost more than a share of what it may save over the runs asked for. Costs are
/// counted, so that the answer depends on no clock.
///
/// @param planned  of a job whose results are points or rays, with its samples
/// @param graph  without a limit of the likeness
/// @param sure   of the same graph
Contest contest_of(const Planned& planned, const PricedGraph& graph, const Plan& sure);

}  // namespace edgewise
