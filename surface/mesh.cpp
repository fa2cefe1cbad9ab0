#include "surface/mesh.hpp"

#include <any>
#include <fmt/format.h>
#include <utility>

#include "graph/errors.hpp"

namespace edgewise::surface {

Mesh::Mesh(std::int64_t vertices, std::int64_t triangles, bool labelled,
           std::pmr::memory_resource* memory) {
    if (vertices > kMost || triangles > kMost)
        throw RunError(fmt::format(
            "the surface has {} vertices and {} triangles; files hold at most {} of each", vertices,
            triangles, kMost));
    const auto v = static_cast<std::size_t>(vertices), t = static_cast<std::size_t>(triangles);
    positions_ = Array(v * sizeof(Float3), memory);
    normals_ = Array(v * sizeof(Float3), memory);
    triangles_ = Array(t * sizeof(Triangle), memory);
    if (labelled) groups_ = Array(t * sizeof(std::uint32_t), memory);
}

double Mesh::bytes(double vertices, double triangles, bool labelled) noexcept {
    return vertices * 2 * sizeof(Float3) +
           triangles * (sizeof(Triangle) + (labelled ? sizeof(std::uint32_t) : 0));
}

std::shared_ptr<const Mesh> mesh_in(const Data& data) {
    const auto* held = std::any_cast<std::shared_ptr<const Mesh>>(&data.other);
    return held ? *held : nullptr;
}

void put_mesh(Data& data, Mesh mesh) {
    data.other = std::shared_ptr<const Mesh>(std::make_shared<Mesh>(std::move(mesh)));
}

}  // namespace edgewise::surface
