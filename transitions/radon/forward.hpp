#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Each sample is spread over the lines that meet its pyramid of the bilinear field, by the exact
/// projection of that. Samples of 0 add nothing and are skipped: the work goes with the number of
/// the others.
///
/// Edge    object/scalar -> hough/scalar, see radon_edge()
/// Needs   a sinogram
/// Work    for each angle and sample other than 0 about 2.5 lines, 28 operations each, and 12 to
///         find them; one by one
/// Error   rounding of the result to f32; sums are in f64
/// Source  [W93] FIGURE 10, forward; the footprint is that of Westover 1990 in two dimensions
Transition radon_forward();

}  // namespace edgewise
