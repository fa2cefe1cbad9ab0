#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Splatting: forward projection, voxel by voxel. Each sample adds its footprint, the integral of
/// its kernel along the rays, to the picture. Samples of the commonest value are passed over: what
/// they add is known from the lengths of rays. So it pays where few others are.
/// Edge    object/scalar -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; one f32 a pixel
/// Needs   integrals or means along parallel rays, finite samples, all in one memory; footprints of
///         at most 64 pixels
/// Work    an operation a voxel; of those that are not empty 30, and 13 and two gathers for each
///         pixel that a footprint may cover
/// Error   that of casting with first-order hold and a step of 1/4, for footprints are integrals of
///         the trilinear field. Tables have 32 cells a voxel: rays are moved by up to 1/64 voxel, a
///         slice at a time. Kernels add up to 1 in any view, so a constant has no ripple.
/// Source  Westover 1990
Transition splat();

}  // namespace edgewise
