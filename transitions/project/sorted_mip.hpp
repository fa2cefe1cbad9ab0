#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Cell-sorted maximum intensity projection: bricks of samples are projected in descending order of
/// what they may hold at most, so that a brick is left out where all its rays have seen as much.
/// Edge    object/sorted (zoh, foh) or object/sorted-coefficients (bspline3), which
///         project.sorted_bricks makes, -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; one f32 a pixel
/// Needs   parallel rays; a mode whose kernels take the largest sample, or the least
/// Work    that of project.ray_cast for the samples that are left; bricks are laid out on tiles of
///         the picture once a view
/// Error   that of project.ray_cast: the same samples, bit for bit
/// Source  Mroz, Hauser, Groeller, "Interactive high-quality maximum intensity projection",
///         Computer Graphics Forum 19(3), 2000
Transition sorted_mip();

}  // namespace edgewise
