#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Gaussians by recursion: along each axis two damped waves forward and two backward, whose sum is
/// close to exp(-k^2 / (2 S^2)). The work does not depend on S.
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Needs   a Gaussian; samples that are finite
/// Work    36 operations in f32 an axis, also for samples around tiles
/// Error   at most the sum of |difference of the two kernels| times half the range of the values;
///         rounding of f32
/// Source  Deriche, "Recursively implementing the Gaussian and its derivatives", INRIA 1893, 1993
Transition filter_recursive();

}  // namespace edgewise
