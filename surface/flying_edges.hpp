#pragma once

#include <functional>
#include <memory_resource>

#include "graph/data.hpp"
#include "graph/transform.hpp"
#include "surface/mesh.hpp"

namespace edgewise::surface {

/// The surface where the trilinear field's edges reach an isovalue.
///
/// A sample is inside where its value is at least the isovalue. Each edge of the grid with one end
/// inside has one vertex, and these are all: vertices are never merged, also where several lie at
/// one sample because its value is the isovalue. So the mesh is a 2-manifold for any data. Some of
/// its triangles may have no area. It is open where the surface meets the volume's faces, and at
/// cells with a corner that is not finite, which make no triangle.
///
/// Normals are those of the field: central differences at both ends of the edge (one-sided at the
/// volume's faces), interpolated, pointing to smaller values. Where they vanish or are not finite
/// the normal runs along the edge, from inside to outside.
///
/// The same bytes for any number of threads. [Schroeder, Maynard, Geveci: Flying Edges, LDAV 2015]
/// @param samples  of one channel, in memory row by row, of a type that can be cut (level.hpp)
/// @param to_file  affine map from indices to where the samples lie
/// @param poll     called once a slice; may throw
/// @throws std::bad_alloc, and RunError where the mesh has more than Mesh::kMost vertices
Mesh flying_edges(const Data& samples, double isovalue, const Mat4& to_file,
                  std::pmr::memory_resource* memory, const std::function<void()>& poll = {});

/// About how many vertices that makes, counted at every fourth slice.
double expected_vertices(const Data& samples, double isovalue, std::pmr::memory_resource* memory);

/// Bytes that it takes beside samples and mesh.
double flying_edges_scratch(const Representation& samples) noexcept;

}  // namespace edgewise::surface
