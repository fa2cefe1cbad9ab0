#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Each sample gathers its neighbourhood: sums, extremes (flat and grey).
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Work    two operations for each place of the kernel that counts
/// Error   that of filtering_edge(); NaN and infinities reach as far as the kernel
/// Source  [W93] FIGURE 10 and EQ 6-9, backward
Transition filter_backward();

}  // namespace edgewise
