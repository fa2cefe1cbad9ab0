#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Multipass warp: shears one axis after another, each by resampling lines, behind an exact
/// permutation of the axes. Three passes where only two axes turn, four otherwise.
/// Edge    object/scalar -> screen/scalar, 2D or 3D, one channel; f32 out
/// Filter  foh: two taps a pass; bspline3: cubic B-spline through each line, four taps a pass
/// Needs   equiareal T, finite samples, one channel; otherwise refused
/// Border  that of warp.backward within two samples of the faces: edges continue during the passes,
///         and the inverse of every screen sample decides what lies outside
/// Work    8 operations a sample and pass with foh (TABLE 6's multipass), 18 with bspline3, over
///         boxes that are larger than input and screen; two intermediate boxes of f32
/// Error   the hold's, once a pass: the bias of warp.backward times passes over axes
/// Source  [W93] 3.6.6, EQ 10 and 32, TABLE 6; four passes instead of EQ 35's six
Transition shear_warp_passes();

}  // namespace edgewise
