#pragma once

#include <string>

#include "graph/transition.hpp"
#include "transitions/kernels/ray_cast.hpp"

namespace edgewise {

/// Combines samples that already lie in screen space, along z: the second half of warp and project.
/// Edge    screen/scalar -> screen/picture
/// Shape   [nz, ny, nx], x fastest, f32; one f32 a pixel, four of composite
/// Needs   parallel rays. Only samples from inside the input count, whatever the warp wrote
///         elsewhere
/// Work    a sample: 1 operation, of composite its optics and EQ 63
/// Error   of a step of 1, measured on the preview; errors of the samples pass with the rule's gain
/// Source  [W93] 4.1.3, EQ 62 and 63
Transition combine();

/// Why samples in screen space cannot be combined along z; empty: they can.
std::string no_combining(const Representation& from, const Ask& ask);
/// Operations of a sample: two comparisons with the span of the ray, its share, and the mode's
/// rule.
double combining_operations(const Request& want, const ValueMap& values);

}  // namespace edgewise
