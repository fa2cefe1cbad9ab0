#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Shear-warp by runs: as project.shear_warp, but of each slice only the runs are added in which
/// something may be seen, and only to pixels of the intermediate image that are not opaque yet.
/// Edge    aligned/runs or object/runs -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; four f32 a pixel
/// Needs   what project.shear_warp needs, and a mode with a transfer function or a level; it makes
///         the same picture to the bit
/// Work    a voxel in a run that is not hidden: as project.shear_warp; a row of a slice: 40
/// Error   that of project.shear_warp
/// Source  Lacroute and Levoy 1994
Transition shear_warp_runs();

}  // namespace edgewise
