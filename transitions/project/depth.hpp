#pragma once

#include "graph/transition.hpp"

namespace edgewise {

// Normals from the picture (image space): the surface's depths are cast, and light is worked out
// from how depth changes between pixels. One sample of the field a ray instead of its gradient;
// edges between surfaces and thin parts are where it fails. Only by --via: the gradient is as fast.

/// Distances of the first hits.
/// Edge    object/scalar or object/coefficients -> screen/depth
/// Shape   [ny, nx], x fastest, f32: screen z of the hit [unit of screen z]; NaN where nothing is
/// hit Needs   a mode that ends at its first hit, parallel rays Work    that of project.ray_cast
/// without light Error   none of its own: it is that of the light made of it
Transition depth_cast();

/// Light from depths.
/// Edge    screen/depth -> screen/picture
/// Needs   parallel rays
/// normals  central: half of the difference of both neighbours; adaptive: of the two neighbours
/// along
///          an axis the one that is nearer in depth, both where they change alike, so that no
///          difference is taken across the edge of a surface
/// Work    a pixel: 20 operations for a normal, 40 a light
/// Error   measured by running it
/// Source  Gordon and Reynolds 1985 (light from depth); Yagel, Cohen and Kaufman 1992 (across
/// edges)
Transition depth_light();

}  // namespace edgewise
