#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// An image from its integrals along lines: filtered backprojection.
///
/// Each row is convolved with the ramp filter, whose samples are 1/4 in the middle, -1/(pi n)^2 at
/// odd n and 0 at other even n (Ram and Lak's: the transform of |f| up to half a cycle an offset,
/// so that rows need no padding by powers of two), and read linearly between offsets, 0 beyond
/// them, at each sample's offset. The sum over angles is weighted by half of the gap to the two
/// nearest angles.
///
/// Edge    object/scalar -> hough/scalar, where a radon job ends
/// Shape   [angles, offsets] in, [y, x] out, of volumes one a slice; see RadonBack
/// Needs   finite samples as they were read, of one channel, in memory, row by row
/// Work    an operation for two of all pairs of offsets, of each row; 14 for each sample and angle
/// Error   rounding of results to f32, of a result some times the mean along a row. That of the
///         method itself, which counts angles and offsets, is none of this edge: the definition is
///         the sum above
/// Source  Ramachandran and Lakshminarayanan 1971; Kak and Slaney 1988, chapter 3
Transition radon_inverse();

}  // namespace edgewise
