#pragma once

#include "transitions/composite/over_edge.hpp"

namespace edgewise {

/// Neighbours are paired from the front. That takes more updates than composite.binary_tree where
/// the number of samples is no power of two, but trees of 1, 2, 4 ... slices in front are whole,
/// and each is a picture.
/// Edge    screen/classified -> screen/picture, see over_edge()
/// Work    of one intensity: 3W - 2 - P multiplications with P ones in the binary W - 1, 2W - 2
///         additions
/// Source  [W93] Appendix B, 2.5, EQ 86, 87 and 89 (mended, see counts_of()), FIGURE 94 and 95
///
/// Progressive refinement, FIGURE 94: with `first` = K, a power of two, a picture of the first K,
/// 2 K, 4 K ... slices is made on the way, and `watch` is called with each; with a watch K is 1 if
/// nothing is said. The last has the same bytes as without.
Transition binary_tree_front_to_back_over(FrontWatch watch = {});

}  // namespace edgewise
