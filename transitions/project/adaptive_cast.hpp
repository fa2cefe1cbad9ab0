#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Ray casting that adapts to the picture: every fourth ray along both axes is cast first; squares
/// between them are interpolated where the picture is smooth, and cast where it is not.
///
/// Smooth is a square whose four corners have second differences, along x and along y, of which an
/// eighth of the largest is below `tolerance`: so much linear interpolation errs by. It is then
/// interpolated by cubics (Keys 1981), which err by less; at a kink by up to three times that. A
/// square is cast too where a corner's ray meets nothing.
/// Edge    object/scalar or object/coefficients -> screen/picture
/// Shape   as project.ray_cast
/// Needs   a mode that takes all samples of a ray, without light; a filter that interpolates; one
///         memory; of rays that are drawn at most four fifths in squares that are not smooth
/// Work    that of project.ray_cast for a sixteenth of the rays and those of squares that differ,
///         whose share by length is counted on squares that are drawn
/// Error   that of project.ray_cast; and what interpolation leaves, measured on the same squares,
///         which are cast for it as the edge does
/// Source  Levoy, "Volume rendering by adaptive refinement", The Visual Computer 6(1), 1990
Transition adaptive_cast();

}  // namespace edgewise
