#pragma once

#include <memory_resource>

#include "surface/mesh.hpp"

namespace edgewise::surface {

/// What hangs together by corners and has the largest area; of labels, of each label. Of equal ones
/// the one with the first triangle. @throws std::bad_alloc
Mesh largest_part(const Mesh& mesh, std::pmr::memory_resource* memory);

/// Fewer triangles for the same shape, by collapsing edges where that errs least (Garland and
/// Heckbert 1997, as meshoptimizer has it). Vertices that stay are where they were, open borders
/// stay open, closed surfaces closed. Labels are taken one by one, so that walls of two of them no
/// longer agree.
/// @param share  of the triangles that goes, 0 to 1
/// @throws RunError a build without meshoptimizer
Mesh decimated(const Mesh& mesh, double share, std::pmr::memory_resource* memory);
bool can_decimate() noexcept;

/// Smoothed by steps forwards and, a little longer, backwards, which takes the steps of samples and
/// leaves the volume nearly as it was. Corners of open borders stay. Normals are those of the
/// triangles. [Taubin: A signal processing approach to fair surface design, 1995]
/// @param share  0 to 1: of 20 rounds
Mesh smoothed(const Mesh& mesh, double share, std::pmr::memory_resource* memory);

/// Bytes that any of these takes beside the meshes, at most about.
double finishing_bytes(double vertices, double triangles) noexcept;

}  // namespace edgewise::surface
