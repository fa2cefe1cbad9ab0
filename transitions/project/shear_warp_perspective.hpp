#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Shear-warp from an eye at a finite distance: slices are scaled and sheared so that rays become
/// parallel, combined from front to back on an intermediate image, and that image is warped to the
/// picture by a homography.
///
/// A pixel of the intermediate image is a ray through a place in the first slice that rays may
/// meet, where `density` pixels stand on a voxel. Farther slices shrink: in one r times as far
/// away, rays are r / density voxels apart. Of what is finer than two of these the picture shows
/// samples, not means: it aliases. A density of r keeps every voxel.
///
/// Slices are those of the axis along which a ray advances most voxels. Where no one axis serves
/// the whole view, each has an intermediate image of its own, for the pixels whose rays belong to
/// it. Rays are sampled where they cross the slices, and a sample weighs the length of its own ray
/// from slice to slice. A pixel is read from its four neighbours, of which integrals and opacities
/// are first made those of the pixel's own length. Where a neighbour misses the volume, or is a
/// quarter longer or shorter, the pixel's own ray is followed through the slices instead. With
/// filter=zoh a pixel is the nearest pixel of the image, as it is.
/// Edge    object/scalar -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; one f32 a pixel, four of composite
/// Needs   an eye at least a voxel outside of the volume; a mode that combines slices one by one,
///         without light; all samples in one memory
/// Work    a slice: 3 operations for each sample of its rows that the image sees; a pixel of the
///         image that it covers: 8, two gathers (foh), and the rule; a pixel of the picture: 300,
///         and 300 more to read four neighbours; of one that is followed, 100 a slice
/// Error   measured by runs
/// Source  Lacroute and Levoy 1994; Schulze, Niemeier and Lang 2001
Transition shear_warp_perspective();

}  // namespace edgewise
