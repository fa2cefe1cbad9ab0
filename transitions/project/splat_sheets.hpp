#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Splatting on sheets: depth is cut into slabs across the rays, as thick as `slab`. Voxels add to
/// each slab what of their footprints lies in it; the sums over the slab's length, which are means
/// of the trilinear field, are samples that are classified and combined from front to back. Slabs
/// lie on the screen, not on the volume's axes: no view pops. Samples are classified after they are
/// splatted; to splat colours of voxels instead would blur them, and let what is behind bleed
/// through what is opaque.
/// Edge    object/scalar -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; one f32 a pixel, four of composite
/// Needs   a mode with a transfer function, or the largest or least sample; parallel rays, finite
///         samples, all in one memory; slabs of at least a quarter of a voxel along the axis that
///         rays are steepest to
/// Work    30 operations a voxel that is not empty; for each slab that it may lie in and each pixel
///         of its footprint 9 and two gathers; combining
/// Error   measured by runs. Tables have 16 cells and 16 sections a voxel; kernels add up to 1
/// Source  Mueller and Crawfis 1998; Westover 1990
Transition splat_sheets();

}  // namespace edgewise
