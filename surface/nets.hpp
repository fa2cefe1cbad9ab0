#pragma once

#include <functional>
#include <memory_resource>

#include "graph/data.hpp"
#include "graph/transform.hpp"
#include "surface/mesh.hpp"

namespace edgewise::surface {

/// Surface nets: one closed surface around the samples of each label.
///
/// Every value other than the background is a label, and has a surface of its own, outwards to
/// whatever is not that label. Where two labels meet, both have a surface there: two sheets, each
/// with vertices of its own and facing the other way. So the surface of each label is a 2-manifold,
/// whatever lies beside it, and it encloses that label alone. Surfaces are open where a label meets
/// the volume's faces, and at cells with a corner that is not finite.
///
/// A cell has one vertex for each part of a label's surface that runs through it, and a grid edge
/// between a label and something else has one quad, cut along its shorter diagonal. Opposite
/// corners of a face are kept apart (cell_cases.hpp); where that would make two quads share two
/// sides they are joined.
///
/// Vertices begin at the mean of the cuts, half way along grid edges. Each smoothing step moves
/// them half way to the mean of their neighbours, and keeps them in their cell. Those on open rims
/// stay. Normals are the mean of the triangles', weighted by area; 0 where these cancel.
///
/// The same bytes for any number of threads. [Gibson: Constrained elastic surface nets, MICCAI
/// 1998; Nielson: Dual marching cubes, VIS 2004; Wenger: Isosurfaces, 2013, on ambiguous faces]
/// @param labels      of one channel, in memory row by row, of a type that can be cut (level.hpp)
/// @param background  the value that is no label
/// @param to_file     affine map from indices to where the samples lie
/// @param poll        called once a slice; may throw
/// @throws std::bad_alloc, and RunError where the mesh has more than Mesh::kMost triangles
Mesh surface_nets(const Data& labels, double background, int smoothing_steps, const Mat4& to_file,
                  std::pmr::memory_resource* memory, const std::function<void()>& poll = {});

/// About how many vertices that makes, counted at every fourth slice.
double expected_net_vertices(const Data& labels, double background);

/// Bytes that it takes beside samples and mesh.
double nets_scratch(const Representation& labels, double vertices, int threads) noexcept;

}  // namespace edgewise::surface
