#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// A closed surface around each label, as triangles. Request::outside is the background.
/// Edge    object/scalar -> object/mesh, 3D
/// Shape   [nz, ny, nx] of u8, i8, u16, i16 or f32 -> a surface::Mesh (surface_of.hpp), placed as
///         the view says
/// Needs   labels as they were read, of one channel. For a picture the surfaces are closed at the
///         volume's faces too, half a sample beyond the outermost, and samples that are not finite
///         are background
/// Work    4 comparisons a sample; 400 operations a vertex, 45 for each smoothing step
/// Error   exact: which samples are inside is never changed
/// Facts   nets/vertices: about how many vertices there are
/// Source  Gibson: Constrained elastic surface nets, MICCAI 1998; surface/nets.hpp
Transition surface_nets_edge();

}  // namespace edgewise
