#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Turns an image by three shears, a volume by four, each by phases of the spectra of its lines. No
/// pass loses anything that the lines' band holds, so that a turn and the turn back give the
/// samples again, and so do twelve turns by 30 degrees.
///
/// Edge    object/scalar -> screen/scalar, 2D and 3D, one channel; f32 out; on demand
/// Needs   equiareal T (any rotation, behind the nearest quarter turns); finite samples; no labels
/// Field   periodic and band-limited, through the samples and a smooth continuation from each face
///         to the opposite one, as wide as the shears need. What has no margin of its own rings at
///         the faces; diagonal frequencies beyond the band of a sheared grid fold over
/// Border  that of warp.backward
/// Work    a pass for each shear, over the box that holds all of them, as warp.phase_shift; in
/// place Error   not known of the field that is asked for; --verify measures it Source  [W93] EQ
/// 10; Unser, Thevenaz, Yaroslavsky, IEEE Trans. Image Proc. 4(10), 1995;
///         the four shears of shear_chain(); Welling, Eddy, Young, Graphical Models 68(4), 2006
Transition phase_shears();

}  // namespace edgewise
