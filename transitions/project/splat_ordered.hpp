#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Splatting in order: voxels are classified first, and their footprints are composited from front
/// to back. They are visited by slices of the axis that rays are steepest to.
///  - order=sample: each voxel is composited as it is visited. Of a footprint of weight w, the
///    length of ray that the voxel stands for at a pixel, (1 - opacity)^w is let through. What
///    overlaps hides what it should blend with, so colours bleed (Westover 1989).
///  - order=sheet: the voxels of a slice are added up on a sheet, by optical depth, and sheets are
///    composited (Westover 1990).
///
/// Both blur colours, for these are splatted in place of values. Both change suddenly ("pop") where
/// a turning volume's steepest axis becomes another. project.splat_sheets does neither; these are
/// kept to be compared with.
/// Edge    object/scalar -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; four f32 a pixel
/// Needs   composite without light; parallel rays, finite samples, all in one memory; footprints of
///         at most 64 pixels
/// Work    twice a sample 8 operations, of those that are seen 60 more; for each pixel of a
///         footprint 45 (sample) or 15 (sheet) and five gathers; a sheet 45 a pixel
/// Error   measured by runs. Footprints are those of project.splat: kernels add up to 1, also near
///         faces, so that a constant's opacity has no ripple in either order
/// Source  Westover, "Interactive volume rendering", Chapel Hill Workshop on Volume Visualization
///         1989; "Footprint evaluation for volume rendering", SIGGRAPH 1990
Transition splat_ordered();

}  // namespace edgewise
