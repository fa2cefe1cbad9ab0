#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Each sample is scattered over its neighbourhood. Samples of 0 add nothing and are skipped: the
/// work goes with the number of the others.
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Needs   a sum
/// Work    two operations for each place of the kernel and each sample other than 0
/// Error   that of filtering_edge()
/// Source  [W93] FIGURE 10 and EQ 6-9, forward
Transition filter_forward();

}  // namespace edgewise
