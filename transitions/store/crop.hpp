#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Crop: keeps the box of samples that differ from the commonest value, and 12 samples around it.
/// Edge    object/scalar -> object/scalar, smaller; `placed` takes the shift, so later edges need
///         not know. Of clipped rays it keeps the box that they see, and 12 samples around it
/// Needs   where rays are not clipped, that the commonest value adds nothing: it is --zero of an
///         X-ray, transparent in a composite, the least value of a MIP, --outside of a warp; a mean
///         counts every sample
/// Work    every sample that is kept is read and written once
/// Error   none: cubic coefficients at the new faces change by 0.268^12 = 1.4e-7 of what neighbours
///         differ there, which is f32 rounding
Transition crop();

}  // namespace edgewise
