#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Extremes and medians through the spectrum, as [W93] 2.3 conjectures: for each level of integer
/// samples, a transform counts the places of the kernel whose sample reaches it. One place is
/// enough for the largest, all are needed for the least, half of them for the middle.
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Needs   integers of at most 16 levels above the lowest; a flat kernel; counts that a transform
///         in f32 tells apart
/// Work    that of filter.fourier for each level
/// Error   none: counts are rounded to integers
Transition filter_fourier_levels();

}  // namespace edgewise
