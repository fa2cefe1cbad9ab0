#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// The surface at the isovalue of Request::surface, as triangles.
/// Edge    object/scalar -> object/mesh, 3D
/// Shape   [nz, ny, nx] of u8, i8, u16, i16 or f32 -> a surface::Mesh (surface_of.hpp), placed as
///         the view says
/// Needs   samples as they were read, of one channel
/// Work    a comparison a sample; 140 operations and 14 gathers a vertex, 30 operations a triangle
/// Error   exact: the surface is defined by linear interpolation along the grid's edges
/// Facts   surface/vertices: about how many vertices there are
/// Source  Schroeder, Maynard, Geveci: Flying Edges, LDAV 2015
Transition flying_edges_edge();

}  // namespace edgewise
