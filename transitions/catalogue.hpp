#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Every edge of this build, the only list of them. The order breaks ties in the planner and is the
/// order in which preparations apply in object space.
Catalogue catalogue();

}  // namespace edgewise
