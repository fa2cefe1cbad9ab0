#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Ray casting through an octree: leaves are crossed at once, elsewhere cells are sampled as
/// project.ray_cast does. A leaf gives its mean: to a maximum once, to an integral times the length
/// of the ray in it, to a composite with the opacity of that length (EQ 53). Leaves and whole nodes
/// are passed by where nothing in them is seen, or (MIP) exceeds what the ray has.
///
/// A composite crosses a leaf only where opacity and colours change no faster between its least and
/// its greatest sample than four times a ramp over the data's range. Other leaves are sampled.
/// Edge    object/octree, which store.octree makes, -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; one f32 a pixel, four of composite
/// Needs   mip, minip, xray, mean or composite without light; one memory
/// Work    a ray 60; a look at the tree 40, for about 8 cells; a sample outside of leaves 30
/// Error   that of project.ray_cast, and with samples that the octree leaves off by e [value], of
///         rays that are at most L long [t]: mip 4 e; mean e; xray e L; composite e times the
///         steepest opacity that is crossed times L / unit, and e times the steepest colour. Upper
///         estimates: the RMS of a sum is no more than the sum of RMS
/// Bytes   with a tolerance of 0 a MIP is that of project.ray_cast, bit for bit; others differ by
///         the rounding of sums
/// Source  [W93] FIGURE 60; Levoy, "Efficient ray tracing of volume data", ACM Trans. Graphics
///         9(3), 1990; Laur and Hanrahan, "Hierarchical splatting", SIGGRAPH 1991
Transition octree_cast();

}  // namespace edgewise
