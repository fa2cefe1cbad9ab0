#pragma once

#include <cstdint>
#include <memory_resource>
#include <optional>

#include "surface/mesh.hpp"

namespace edgewise::surface {

/// What a mesh amounts to, in its own unit.
struct Measures {
    std::int64_t vertices = 0, triangles = 0;
    /// Every side of a triangle belongs to exactly one other triangle, which passes it the other
    /// way. True of an empty mesh.
    bool closed = true;
    double area = 0;
    std::optional<double> volume;  // that is enclosed; absent where the mesh is not closed
};

/// In f64; the same for any number of threads.
Measures measures_of(const Mesh& mesh, std::pmr::memory_resource* memory);

/// Bytes that measuring takes beside the mesh.
double measuring_bytes(double vertices, double triangles) noexcept;

}  // namespace edgewise::surface
