#pragma once

#include "graph/front_watch.hpp"
#include "graph/transform_graph.hpp"
#include "graph/transition.hpp"

namespace edgewise {

/// Every edge of this build, the only list of them. The order breaks ties in the planner and is the
/// order in which preparations apply in object space.
/// @throws RunError on a processor that kernels are not compiled for
Catalogue catalogue();

/// The same edges. Those that make a picture from the front show it to a watch on the way; others
/// that make pictures refuse to.
Catalogue watched(Catalogue edges, const FrontWatch& watch);

}  // namespace edgewise
