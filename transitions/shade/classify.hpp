#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Samples as light and opacity before they are moved: FIGURE 57 of the thesis, where alpha and the
/// shaded intensity are warped and not the scalar (pre-classification). Its picture differs from one
/// that is classified behind the warp, the more the steeper the transfer function is.
/// Edge    object/scalar -> object/colored, 3D
/// Shape   [nz, ny, nx], x fastest -> four f32 a sample: red, green and blue times the opacity, and
///         the opacity, for one unit of the transfer function
/// Needs   a mode with a transfer function; of lit samples one view for all frames, parallel rays
/// Error   none of its own: what interpolation of light instead of values makes of it is the warp's
/// Source  [W93] 4.1.1 to 4.1.3, FIGURE 57; Levoy 1988
Transition shade_classify();

/// From colours in screen space to what compositing takes: opacities for the length of each cell.
/// Edge    screen/colored -> screen/classified
/// Source  [W93] EQ 63, EQ 83 and 88
Transition colored_lengths();

/// What the samples of one representation become.
Representation colored_of(const Representation& from);

}  // namespace edgewise
