#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Each sample is scattered over its neighbourhood: it is added to the sums there, or raises the
/// extremes. Samples of 0 add nothing to sums, the lowest of a tile (of erosions the highest) raise
/// no extreme. They are skipped: the work goes with the number of the others.
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Needs   a sum, or dilation or erosion, flat or grey
/// Work    two operations for each place of the kernel and each sample that is not skipped
/// Error   that of filtering_edge()
/// Source  [W93] FIGURE 10 and EQ 6-9, forward
Transition filter_forward();

}  // namespace edgewise
