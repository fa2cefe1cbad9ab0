#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <span>
#include <vector>

#include "graph/data.hpp"

namespace edgewise::surface {

/// Three numbers a vertex or a triangle, one after another.
using Float3 = std::array<float, 3>;
using Triangle = std::array<std::uint32_t, 3>;

/// Triangles that share vertices. Seen from outside their corners go counter-clockwise.
class Mesh {
 public:
    Mesh() = default;
    /// Room for so many; the contents are not initialised.
    /// @throws std::bad_alloc, and RunError above kMost vertices or triangles
    Mesh(std::int64_t vertices, std::int64_t triangles, bool labelled,
         std::pmr::memory_resource* memory);

    /// Files hold indices of 32 bits with a sign.
    static constexpr std::int64_t kMost = 0x7fffffff;
    /// Bytes that a mesh takes.
    static double bytes(double vertices, double triangles, bool labelled) noexcept;

    std::span<Float3> positions() noexcept { return of<Float3>(positions_); }
    std::span<const Float3> positions() const noexcept { return of<const Float3>(positions_); }
    /// Of length one, pointing outwards.
    std::span<Float3> normals() noexcept { return of<Float3>(normals_); }
    std::span<const Float3> normals() const noexcept { return of<const Float3>(normals_); }
    std::span<Triangle> triangles() noexcept { return of<Triangle>(triangles_); }
    std::span<const Triangle> triangles() const noexcept { return of<const Triangle>(triangles_); }
    /// Of each triangle the place of its label in `labels`; empty for an isosurface.
    std::span<std::uint32_t> groups() noexcept { return of<std::uint32_t>(groups_); }
    std::span<const std::uint32_t> groups() const noexcept {
        return of<const std::uint32_t>(groups_);
    }

    std::vector<double> labels;  // ascending

 private:
    template <class T>
    static std::span<T> of(const Array& array) noexcept {
        return {static_cast<T*>(const_cast<void*>(array.data())), array.bytes() / sizeof(T)};
    }

    Array positions_, normals_, triangles_, groups_;
};

/// The mesh that data are (Data::other). Null where they are none.
std::shared_ptr<const Mesh> mesh_in(const Data& data);
void put_mesh(Data& data, Mesh mesh);

}  // namespace edgewise::surface
