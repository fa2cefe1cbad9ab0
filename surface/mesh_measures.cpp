#include "surface/mesh_measures.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <numeric>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

namespace edgewise::surface {
namespace {

constexpr std::size_t kLeaf = 1 << 14;  // triangles, vertices

/// Whether every side has exactly one other triangle, that passes it the other way. Sides are
/// sorted into their lower vertex, where few meet.
bool is_closed(const Mesh& mesh, std::pmr::memory_resource* memory) {
    const auto triangles = mesh.triangles();
    const std::size_t vertices = mesh.positions().size();
    Array starts((vertices + 1) * sizeof(std::uint64_t), memory);
    Array sides(triangles.size() * 3 * sizeof(std::uint32_t), memory);
    auto* start = static_cast<std::uint64_t*>(starts.data());
    auto* side = static_cast<std::uint32_t*>(sides.data());
    std::fill_n(start, vertices + 1, 0);
    const auto for_each_side = [&](auto body) {
        for (const Triangle& t : triangles)
            for (int i = 0; i < 3; ++i) {
                const std::uint32_t a = t[i], b = t[(i + 1) % 3];
                body(std::min(a, b), std::max(a, b), a < b);
            }
    };
    for_each_side([&](std::uint32_t low, std::uint32_t, bool) { ++start[low]; });
    std::partial_sum(start, start + vertices + 1, start);  // the ends; filled from behind
    // Indices have 31 bits; the lowest one says which way the side is passed.
    for_each_side([&](std::uint32_t low, std::uint32_t high, bool up) {
        side[--start[low]] = high << 1 | (up ? 1u : 0u);
    });
    std::atomic<bool> closed = true;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, vertices, kLeaf), [&](const auto& part) {
        for (std::size_t v = part.begin(); v != part.end(); ++v) {
            std::uint32_t *begin = side + start[v], *end = side + start[v + 1];
            std::sort(begin, end);
            bool paired = (end - begin) % 2 == 0;
            for (std::uint32_t* at = begin; paired && at < end; at += 2)
                paired = at[1] == at[0] + 1 && at[0] % 2 == 0 &&
                         (at + 2 == end || at[2] / 2 != at[0] / 2);
            if (!paired) closed.store(false, std::memory_order_relaxed);
        }
    });
    return closed;
}

struct Sums {
    double area = 0, volume = 0;
};

Eigen::Vector3d corner(const Mesh& mesh, std::uint32_t vertex, const Eigen::Vector3d& about) {
    const Float3& p = mesh.positions()[vertex];
    return Eigen::Vector3d(p[0], p[1], p[2]) - about;
}

}  // namespace

Measures measures_of(const Mesh& mesh, std::pmr::memory_resource* memory) {
    Measures result;
    const auto triangles = mesh.triangles();
    result.vertices = static_cast<std::int64_t>(mesh.positions().size());
    result.triangles = static_cast<std::int64_t>(triangles.size());
    result.closed = is_closed(mesh, memory);
    // About a point of the mesh: far from the origin the sum would lose digits.
    const Eigen::Vector3d about = triangles.empty()
                                      ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                      : corner(mesh, triangles[0][0], Eigen::Vector3d::Zero());
    const Sums sums = tbb::parallel_deterministic_reduce(
        tbb::blocked_range<std::size_t>(0, triangles.size(), kLeaf), Sums{},
        [&](const auto& part, Sums sum) {
            for (std::size_t i = part.begin(); i != part.end(); ++i) {
                const Eigen::Vector3d a = corner(mesh, triangles[i][0], about),
                                      b = corner(mesh, triangles[i][1], about),
                                      c = corner(mesh, triangles[i][2], about);
                sum.area += (b - a).cross(c - a).norm() / 2;
                sum.volume += a.dot(b.cross(c)) / 6;
            }
            return sum;
        },
        [](const Sums& a, const Sums& b) {
            return Sums{a.area + b.area, a.volume + b.volume};
        });
    result.area = sums.area;
    if (result.closed) result.volume = sums.volume;
    return result;
}

double measuring_bytes(double vertices, double triangles) noexcept {
    return (vertices + 1) * sizeof(std::uint64_t) + 3 * triangles * sizeof(std::uint32_t);
}

}  // namespace edgewise::surface
