#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// A surface of triangles as a picture: a z-buffer.
/// Edge    object/mesh -> screen/picture, four channels
/// Needs   a mode that ends at its first hit; affine views, orthographic or with an eye
/// Work    a vertex 30 operations, a triangle 60 and its pixels 20 each; 150 a pixel that is lit
/// Error   measured by running it: a mesh is flat between the edges of the grid, and ends at the
///         outermost samples
/// Source  [W93] 4.2.3; Catmull 1974; Gouraud 1971; Phong 1975
Transition draw_edge();

}  // namespace edgewise
