#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Extremes over flat kernels of any shape, from extremes over runs of 1, 2, 4, ... samples: each
/// run of the kernel is the union of two of them. A box is worked off axis by axis.
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Needs   dilation or erosion by a flat kernel; samples that are finite
/// Work    one comparison for each doubling and two for each run of the kernel
/// Error   none
/// Source  Urbach and Wilkinson, "Efficient 2-D grayscale morphological transformations with
///         arbitrary flat structuring elements", IEEE TIP 17(1), 2008
Transition filter_runs();

}  // namespace edgewise
