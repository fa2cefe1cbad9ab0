#pragma once

#include "graph/front_watch.hpp"
#include "graph/transition.hpp"

namespace edgewise {

/// Ray casting that goes from depth to depth: all rays are cast through the slab in front, then
/// through the next one, and what they have seen so far is a picture. For somebody who watches, or
/// is content with what is there at some time.
///
/// A slab is a range of t on each ray, of whole steps. So samples lie where project.ray_cast takes
/// them, and the last picture differs from its picture by the rounding of a join for each slab. A
/// tile is left alone once less than kTerminated of light passes each of its pixels.
/// Edge    object/scalar (zoh, foh) or object/coefficients (bspline3) -> screen/picture
/// Shape   as project.ray_cast
/// Needs   a mode that composites; lit or not, from an eye or parallel; one memory
/// Work    that of project.ray_cast; for each slab 120 operations a ray of the tiles that meet it,
///         and 8 to join
/// Error   that of project.ray_cast, and 2^-24 of light for each slab
/// Source  [W93] Appendix B, 2.5, along rays
/// @param watch  is shown the picture after each slab; empty: nobody watches
Transition front_cast(FrontWatch watch = {});

}  // namespace edgewise
