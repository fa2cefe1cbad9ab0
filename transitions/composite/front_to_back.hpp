#pragma once

#include "transitions/composite/over_edge.hpp"

namespace edgewise {

/// ((I1 over I2) over I3) over I4: from the front, so that what is done after any slice is a
/// picture. No ray ends early: counts are those of all samples.
/// Edge    screen/classified -> screen/picture, see over_edge()
/// Work    of one intensity: 3W - 3 multiplications, 2W - 2 additions
/// Source  [W93] Appendix B, 2.3, EQ 62, 63, 86 and 87, FIGURE 90
///
/// Progressive refinement: with `every` = K a picture of the first K, 2 K, 3 K ... slices is made
/// on the way, and `watch` is called with each; with a watch and no K there are sixteen. The last
/// has the same bytes as without.
Transition front_to_back_over(FrontWatch watch = {});

}  // namespace edgewise
