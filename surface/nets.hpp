#pragma once

#include <functional>
#include <memory_resource>

#include "graph/data.hpp"
#include "graph/transform.hpp"
#include "surface/mesh.hpp"

namespace edgewise::surface {

/// Surface nets: one closed surface around the samples of each label.
///
/// A sample fills its voxel, to half a step beyond its centre. Every value other than the
/// background is a label, and has a surface of its own, outwards to whatever is not that label.
/// Where two labels meet, both have a surface there: two sheets in one place, each with vertices of
/// its own and facing the other way. So the surface of each label is a closed 2-manifold, whatever
/// lies beside it, it encloses that label alone, and there is neither a gap nor an overlap between
/// labels. A label that reaches the scan's end is closed there, by a flat face. What is not finite
/// is background.
///
/// A cell of eight samples, a corner of voxels, has one vertex for each part of a label's surface
/// that runs through it, all of them in one place, and a grid edge between a label and something
/// else has one quad, cut along its shorter diagonal. Opposite corners of a face are kept apart
/// (cell_cases.hpp); where that would make two quads share two sides they are joined.
///
/// Vertices begin in the middle of their cells: the mesh is that of the voxels' faces, and encloses
/// what samples fill. Smoothing moves them within their cells, and keeps volumes
/// (nets_smoothing.hpp). Normals are the mean of the triangles', weighted by area; 0 where these
/// cancel.
///
/// The same bytes for any number of threads. [Gibson: Constrained elastic surface nets, MICCAI
/// 1998; Frisken: SurfaceNets for multi-label segmentations, JCGT 2022, on lines where several
/// labels meet; Nielson: Dual marching cubes, VIS 2004; Wenger: Isosurfaces, 2013, on ambiguous
/// faces]
/// @param labels      of one channel, in memory row by row, of any type of real numbers
/// @param background  the value that is no label
/// @param smooth      0 to 1: how far vertices may go, of half a step along each axis
/// @param to_file     affine map from indices to where the samples lie
/// @param poll        called once a slice; may throw
/// @throws std::bad_alloc, and RunError where the mesh has more than Mesh::kMost triangles
Mesh surface_nets(const Data& labels, double background, double smooth, const Mat4& to_file,
                  std::pmr::memory_resource* memory, const std::function<void()>& poll = {});

/// About how many vertices that makes, counted at every fourth slice.
double expected_net_vertices(const Data& labels, double background);

/// Bytes that it takes beside samples and mesh.
double nets_scratch(const Representation& labels, double vertices, int threads) noexcept;

}  // namespace edgewise::surface
