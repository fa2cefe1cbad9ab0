#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Shear-warp: slices are sheared onto an intermediate image along their own z axis, with four
/// constant weights a slice and no gather, then that image is warped to the picture.
/// Edge    aligned/scalar or object/scalar -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; one f32 a pixel, four of composite
/// Needs   parallel rays whose steepest axis is z in every view
/// Work    a voxel: 9 operations (bilinear) and the rule; a pixel: FIGURE 27
/// Error   that of casting with steps from slice to slice, and of a second bilinear reconstruction
/// Source  Lacroute and Levoy 1994
Transition shear_warp();

}  // namespace edgewise
