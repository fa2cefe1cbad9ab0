#pragma once

#include "graph/front_watch.hpp"
#include "graph/transform_graph.hpp"
#include "graph/transition.hpp"

namespace edgewise {

/// Every edge of this build, the only list of them. The order breaks ties in the planner and is the
/// order in which preparations apply in object space.
Catalogue catalogue();

/// The same edges, of which those that can stop on the way show their pictures to a watch.
Catalogue watched(Catalogue edges, const FrontWatch& watch);
/// The demands of a request whose pictures on the way are watched: those that are asked for, and
/// composite.front_to_back where none of them names an edge that shows any.
Demands watched(Demands asked);

}  // namespace edgewise
