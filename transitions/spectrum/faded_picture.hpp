#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// The picture of a slice whose light falls off, or that light falls on: inverse transform, the
/// constant that was taken away times the integral of its light along each ray inside the volume,
/// which is known, and the division by the ray's length for the mean.
///
/// Edge    slice/faded, slice/lit -> screen/picture, f32 [height, width]
/// Work    that of spectrum.inverse and 20 a pixel for the integral of light
/// Error   none of its own; of the constant the cue is exact, exponential or not
Transition spectrum_faded_picture();

}  // namespace edgewise
