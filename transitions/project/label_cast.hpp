#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Surfaces of labels: rays go from voxel to voxel up to the first that holds a label.
/// Edge    object/scalar -> screen/picture, four channels
/// Shape   [nz, ny, nx] of u8, i8, u16, i16 or f32 -> [height, width, 4]
/// Needs   a mode that ends at its first hit and asks for labels; affine views, orthographic or
///         with an eye; clips, whose cuts close the labels
/// Work    a voxel that is passed 60 operations and a read; a pixel that is lit 6000 and 512 reads:
///         one by one, without vectors
/// Error   measured by running it: voxels have their exact faces, in f64. The reference looks
///         every 1/8 of a sample and may step over a voxel's corner
/// Facts   label_cast/passed, label_cast/lit: voxels that a ray passes, and the share of pixels
///         that are lit
/// Source  Amanatides and Woo, A fast voxel traversal algorithm, Eurographics 1987
Transition label_cast();

}  // namespace edgewise
