#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Spreads the input over ranks, processors with memory of their own: each reads its share.
/// Edge    object/scalar on disk -> object/scalar over ranks; plans only
/// Shape   any; the same samples, cut evenly over Request::ranks
/// Needs   more than one rank
/// Work    one start: like the samples of a plan for one rank, these are where they are needed when
///         the seconds begin
/// Source  [W93] 3.8 and FIGURE 41: column, slice and dice virtualization
Transition spread_over_ranks();

}  // namespace edgewise
