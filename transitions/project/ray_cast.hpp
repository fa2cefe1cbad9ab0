#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Backward ray casting: each pixel follows its view ray through the samples, front to back.
/// Edge    object/scalar (zoh, foh) or object/coefficients (bspline3) -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; one f32 a pixel, four of composite
/// Needs   an affine view; orthographic or with an eye
/// Work    a sample: place 9, filter 0, 21 or 195, combining; 1, 8 or 64 gathers (TABLE 6)
/// Error   reconstruction and quadrature, measured on the preview; early termination leaves at most
///         kTerminated of the brightest emission
/// Source  [W93] 4.2.1, EQ 62 and 63
Transition ray_cast();

/// The same with the gradients that lie beside the samples, instead of the filter's own.
Transition gradient_cast();

/// The same through a level of detail (store.reduce), whose cells it reads linearly. Steps count in
/// the input's smallest spacing; as long as the cells are wide is enough.
/// Error   measured on the preview at levels 1 and 2, of others unknown
Transition level_cast();

/// Composites without light whose transfer function is integrated between samples (of first order:
/// within a piece all light is attenuated alike), so that what is narrower than two samples apart
/// is not missed: for steep functions, and long steps.
/// Needs   a mode with a transfer function, one memory
/// Work    that of ray_cast, eight more gathers and an exponential a sample, a table a view
/// Error   measured on the preview
/// Source  Engel, Kraus, Ertl, "High-quality pre-integrated volume rendering using
///         hardware-accelerated pixel shading", 2001
Transition preintegrated_cast();

}  // namespace edgewise
