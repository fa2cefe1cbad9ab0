#pragma once

#include "graph/transition.hpp"

namespace edgewise {

// FIGURE 57 of the thesis: light and opacity are warped, and not the scalar (pre-classification).
// The picture differs from one that is classified behind the warp, the more the steeper the
// transfer function is; what it costs is one classification a sample, whatever the number of views.
// Only by
// --via: within an error rays are faster.

/// Samples become light and opacity.
/// Edge    object/scalar -> object/colored, 3D
/// Shape   [nz, ny, nx], x fastest -> four f32 a sample: red, green and blue times the opacity, and
///         the opacity, for one unit of the transfer function
/// Needs   a mode with a transfer function; of lit samples one view for all frames, parallel rays
/// Error   none of its own: interpolating light in place of values is the warp's error
/// Source  [W93] 4.1.1 to 4.1.3, FIGURE 57; Levoy 1988
Transition shade_classify();

/// The same with percentages of materials: points of the transfer function are materials, and a
/// sample holds the two whose values are its neighbours, in shares that follow from its value.
/// Their light and opacities are added by shares, and normals are those of the opacity. Needs   no
/// opacity by gradient Error   measured by running it: it is another classification than the
/// transfer function's Source  Drebin, Carpenter and Hanrahan 1988; [W93] 4.1.1
Transition shade_materials();

/// The screen's samples of light and opacity along z.
/// Edge    screen/colored -> screen/picture
/// Work    a sample: a correction of its opacity, 3 operations a colour and 2 of transparency
/// Source  [W93] EQ 62 and 63
Transition composite_colored();

}  // namespace edgewise
