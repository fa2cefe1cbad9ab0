#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Shear-warp from an eye by runs: as project.shear_warp_perspective, but of each slice only the
/// runs are added in which something may be seen, and only to pixels of the intermediate image that
/// are not opaque yet.
/// Edge    object/sliced_runs -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; four f32 a pixel of composite, one of others
/// Needs   what project.shear_warp_perspective needs, and a mode with a transfer function or a
///         level; it makes the same picture to the bit
/// Work    that of project.shear_warp_perspective, of samples in runs that are not hidden; a row of
///         a tile of the image and a slice: 40 operations, and 60 a run
/// Error   measured by runs
/// Source  Lacroute and Levoy 1994
Transition shear_warp_perspective_runs();

}  // namespace edgewise
