#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// The picture of a slice: inverse transform, the constant that was taken away times each ray's
/// length inside the volume, and the division by that length for the mean. A radiograph is that of
/// a uniform medium with the same sum and length (pixel_of_sum).
///
/// Edge    slice/spectrum -> screen/picture, f32 [height, width]
/// Work    5 n log2 n a column and 5/2 n log2 n a row of the period, 30 a pixel for the ray's
///         length, 40 more of a radiograph
/// Error   none of its own (rounding of f32 is counted in spectrum.forward)
Transition spectrum_inverse();

}  // namespace edgewise
