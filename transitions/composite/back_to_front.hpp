#pragma once

#include "transitions/composite/over_edge.hpp"

namespace edgewise {

/// I1 over (I2 over (I3 over I4)): from the back, each sample over all that lies behind it. The
/// fewest operations, as no intensity asks for the transparency of a composite.
/// Edge    screen/classified -> screen/picture, see over_edge()
/// Work    of one intensity: 2W - 1 multiplications, 2W - 2 additions
/// Source  [W93] Appendix B, 2.2, EQ 66 and 86, FIGURE 88
Transition back_to_front_over();

}  // namespace edgewise
