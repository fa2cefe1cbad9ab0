#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Backward warp: every screen sample is reconstructed where T^-1 puts it in object space.
/// Edge    object/scalar -> screen/scalar (zoh, foh), object/coefficients -> screen/scalar
///         (bspline3); 2D or 3D, f32 out, channels interleaved
/// Needs   an invertible T; any scale. Projective maps of images only. Labels take zoh alone
/// Border  the input reaches half a sample beyond the outermost centres; the request's `outside`
///         farther out
/// Work    a sample of a block of 16 columns that sees the input (FIGURE 27): 2D, foh: 23
///         operations (inverse 8, clip 4, rounding 2, bilinear 9) and 4 gathers; 3D, foh: 45 (15,
///         6, 3, 21) and 8: the 39 of TABLE 6 and the clipping that it leaves out
/// Error   that of the hold at fractions of a sample, measured on the scene; none where every view
///         is a copy of samples
/// Source  [W93] 3.6.1, FIGURE 26 and 27, TABLE 6, EQ 16 and 21
Transition backward_warp();

/// The same of samples of light and opacity, object/colored -> screen/colored (shade/classify.hpp).
/// Error   of a picture that is made of them, measured by running it
Transition colored_warp();

}  // namespace edgewise
