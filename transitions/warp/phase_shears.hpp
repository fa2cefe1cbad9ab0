#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Turns an image by three shears, a volume by four, each by phases of the spectra of its lines. No
/// pass loses frequencies of the lines' band. So a turn and the turn back restore the samples, and
/// so do twelve turns by 30 degrees.
///
/// Edge    object/scalar -> screen/scalar, 2D and 3D, one channel; f32 out; on demand
/// Needs   equiareal T (any rotation, behind the nearest quarter turns); finite samples; no labels
/// Field   periodic and band-limited, through the samples and a smooth continuation from each face
///         to the opposite one, as wide as the shears need. Data without a margin ring at
///         the faces; diagonal frequencies beyond the band of a sheared grid fold over
/// Border  that of warp.backward
/// Work    a pass in place for each shear, as warp.phase_shift, over the box that holds all of them
/// Error   unknown for the field of the request; --verify measures it
/// Source  [W93] EQ 10; Unser, Thevenaz, Yaroslavsky, IEEE Trans. Image Proc. 4(10), 1995; the four
///         shears of shear_chain(); Welling, Eddy, Young, Graphical Models 68(4), 2006
Transition phase_shears();

}  // namespace edgewise
