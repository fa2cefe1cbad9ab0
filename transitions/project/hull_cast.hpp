#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Ray casting from a hull of what may be seen: rays begin and end at slabs in 13 directions around
/// all bricks of 4^3 samples that may be seen. Of a composite these have an opacity, of a surface
/// values that reach its level.
///
/// The hull is widened by a cell of the rays, of a surface by two. So a cell that it cuts lies
/// outside of what may be seen, and shows nothing whole or cut; all others have their samples where
/// project.ray_cast has them. Pictures differ by rounding alone: f32 places count from where a ray
/// begins.
/// Edge    object/scalar or object/coefficients -> screen/picture; only by --via
/// Shape   as project.ray_cast
/// Needs   composite, or the first hit of a level; one memory
/// Work    the bricks of project.ray_cast, one look at each, and up to 26 planes a ray
/// Error   that of project.ray_cast
/// Source  Avila, Sobierajski, Kaufman, "Towards a comprehensive volume visualization system",
///         Visualization 1992 (rays from a polygonal hull); Kay and Kajiya, "Ray tracing complex
///         scenes", SIGGRAPH 1986 (slabs); Klosowski and others, "Efficient collision detection
///         using bounding volume hierarchies of k-DOPs", IEEE TVCG 4(1), 1998
Transition hull_cast();

}  // namespace edgewise
