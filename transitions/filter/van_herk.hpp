#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Extremes over flat boxes by three comparisons a sample and axis, whatever the size: in blocks as
/// long as the box, extremes from the start of a block and to its end.
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Needs   dilation or erosion by a flat box; samples that are finite
/// Work    three comparisons an axis; along rows one by one
/// Error   none
/// Source  van Herk 1992; Gil and Werman 1993
Transition filter_van_herk();

}  // namespace edgewise
