#pragma once

#include "transitions/composite/over_edge.hpp"

namespace edgewise {

/// I1 + I2 t1 + I3 t1 t2 + ...: each sample as the eye sees it, then the sum of all, which is added
/// up in a tree. Transparencies are multiplied one after another here; a parallel machine scans.
/// Edge    screen/classified -> screen/picture, see over_edge()
/// Work    of one intensity: 3W - 3 multiplications, 2W - 2 additions
/// Source  [W93] Appendix B, 2.6, EQ 91, FIGURE 96
Transition attenuated_sum();

}  // namespace edgewise
