#pragma once

#include "transitions/composite/over_edge.hpp"

namespace edgewise {

/// (I1 over I2) over (I3 over I4): neighbours are paired from the back, so that as many composites
/// as can be lie along the back, where no transparency is needed. On parallel machines ceil(log2 W)
/// composites one after another.
/// Edge    screen/classified -> screen/picture, see over_edge()
/// Work    of one intensity: 3W - 2 - L multiplications with L = ceil(log2 W), 2W - 2 additions
/// Source  [W93] Appendix B, 2.4, EQ 86 and 87, FIGURE 93; Lemma 4.1
Transition binary_tree_over();

}  // namespace edgewise
