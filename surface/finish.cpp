#include "surface/finish.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tuple>
#include <utility>
#include <vector>

#include "graph/errors.hpp"

#ifdef EDGEWISE_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

namespace edgewise::surface {
namespace {

constexpr std::uint32_t kUnused = 0xffffffff;

Eigen::Vector3d place(const Mesh& mesh, std::uint32_t vertex) {
    const Float3& p = mesh.positions()[vertex];
    return {p[0], p[1], p[2]};
}

std::uint32_t group_of(const Mesh& mesh, std::size_t triangle) {
    return mesh.groups().empty() ? 0 : mesh.groups()[triangle];
}

/// What a mesh says of a vertex.
struct Vertex {
    Float3 position, normal;
};

/// The mesh of some triangles, with the vertices that they use, in their order.
/// @param groups  of each; empty where the mesh has none
/// @param added   vertices that follow those of the mesh
Mesh mesh_of(const Mesh& from, const std::vector<Triangle>& triangles,
             const std::vector<std::uint32_t>& groups, std::pmr::memory_resource* memory,
             const std::vector<Vertex>& added = {}) {
    const std::size_t before = from.positions().size();
    std::vector<std::uint32_t> place_of(before + added.size(), kUnused);
    for (const Triangle& triangle : triangles)
        for (const std::uint32_t vertex : triangle) place_of[vertex] = 0;
    std::uint32_t count = 0;
    for (std::uint32_t& at : place_of)
        if (at != kUnused) at = count++;
    Mesh mesh(count, static_cast<std::int64_t>(triangles.size()), !from.groups().empty(), memory);
    for (std::size_t v = 0; v < place_of.size(); ++v) {
        if (place_of[v] == kUnused) continue;
        const bool is_new = v >= before;
        mesh.positions()[place_of[v]] = is_new ? added[v - before].position : from.positions()[v];
        mesh.normals()[place_of[v]] = is_new ? added[v - before].normal : from.normals()[v];
    }
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) mesh.triangles()[t][k] = place_of[triangles[t][k]];
    std::copy(groups.begin(), groups.end(), mesh.groups().begin());
    mesh.labels = from.labels;
    return mesh;
}

/// Which vertices hang together: the least vertex of each part stands for it.
std::vector<std::uint32_t> parts_of(const Mesh& mesh) {
    std::vector<std::uint32_t> parent(mesh.positions().size());
    std::iota(parent.begin(), parent.end(), 0U);
    const auto root = [&](std::uint32_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    for (const Triangle& t : mesh.triangles())
        for (std::size_t k = 1; k < 3; ++k) {
            const std::uint32_t a = root(t[0]), b = root(t[k]);
            parent[std::max(a, b)] = std::min(a, b);
        }
    for (std::uint32_t v = 0; v < parent.size(); ++v) parent[v] = root(v);
    return parent;
}

#ifdef EDGEWISE_MESHOPTIMIZER
/// Moves vertices that lie in one place a little apart, as the simplifier takes such for one: where
/// an isovalue is that of samples, a closed surface would come apart there.
void move_apart(std::vector<Float3>& positions) {
    std::vector<std::uint32_t> order(positions.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::pair(positions[a], a) < std::pair(positions[b], b);
    });
    Float3 low = positions[0], high = positions[0];
    for (const Float3& p : positions)
        for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], p[k]);
            high[k] = std::max(high[k], p[k]);
        }
    constexpr float kApart = 1e-5F;  // of the extent: far above the rounding of f32
    const float apart = kApart * std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
    for (std::size_t i = 0; i < order.size();) {
        const Float3 here = positions[order[i]];
        std::size_t same = 0;
        for (; i < order.size() && positions[order[i]] == here; ++i, ++same)
            if (same > 0)
                positions[order[i]][same % 3] += apart * (1 + static_cast<float>(same / 3));
    }
}

/// Triangles of one surface, fewer of them. @param local  room for as many as the mesh has vertices
void decimate_part(const Mesh& mesh, double share, const std::vector<Triangle>& part,
                   std::vector<std::uint32_t>& local, std::vector<Triangle>& out) {
    std::vector<unsigned> indices, less(3 * part.size());
    std::vector<std::uint32_t> vertices;
    std::vector<Float3> positions;
    for (const Triangle& triangle : part)
        for (const std::uint32_t vertex : triangle) {
            if (local[vertex] == kUnused) {
                local[vertex] = static_cast<std::uint32_t>(vertices.size());
                vertices.push_back(vertex);
                positions.push_back(mesh.positions()[vertex]);
            }
            indices.push_back(local[vertex]);
        }
    for (const std::uint32_t vertex : vertices) local[vertex] = kUnused;
    move_apart(positions);
    const auto target =
        3 * static_cast<std::size_t>(std::llround((1 - share) * static_cast<double>(part.size())));
    constexpr float kAnyError = 1;  // of the extent: the number of triangles decides
    const std::size_t count =
        meshopt_simplify(less.data(), indices.data(), indices.size(), positions.data()->data(),
                         positions.size(), sizeof(Float3), target, kAnyError, 0, nullptr);
    for (std::size_t i = 0; i + 2 < count; i += 3)
        out.push_back({vertices[less[i]], vertices[less[i + 1]], vertices[less[i + 2]]});
}

/// A side of a triangle.
struct Side {
    std::uint32_t low, high;  // its vertices
    bool down;                // passed from the higher one to the lower one
    std::uint32_t triangle, opposite;

    auto key() const noexcept { return std::tuple(low, high, down, triangle); }
    bool same_place(const Side& other) const noexcept {
        return low == other.low && high == other.high;
    }
};

std::vector<Side> sides_of(const std::vector<Triangle>& triangles, std::size_t begin) {
    std::vector<Side> sides;
    sides.reserve(3 * (triangles.size() - begin));
    for (std::size_t t = begin; t < triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
            sides.push_back({std::min(a, b), std::max(a, b), a > b, static_cast<std::uint32_t>(t),
                             triangles[t][(k + 2) % 3]});
        }
    std::sort(sides.begin(), sides.end(),
              [](const Side& a, const Side& b) { return a.key() < b.key(); });
    return sides;
}

/// Puts a vertex on a side of a triangle: two triangles in its place.
void divide(std::vector<Triangle>& triangles, const Side& side, std::uint32_t vertex) {
    Triangle first = triangles[side.triangle], second = first;
    for (std::size_t k = 0; k < 3; ++k) {
        if (first[k] == side.high) first[k] = vertex;
        if (second[k] == side.low) second[k] = vertex;
    }
    triangles[side.triangle] = first;
    triangles.push_back(second);
}

/// Two triangles that pass a side in opposite ways, and are not yet divided; none: null. Such as
/// are folded onto each other would share the side to the vertex between.
std::pair<const Side*, const Side*> pair_of(std::span<const Side> same,
                                            const std::vector<bool>& divided) {
    for (const Side& up : same)
        for (const Side& down : same)
            if (!up.down && down.down && up.opposite != down.opposite && !divided[up.triangle] &&
                !divided[down.triangle])
                return {&up, &down};
    return {nullptr, nullptr};
}

Vertex between(const Vertex& a, const Vertex& b, float share) {
    Vertex vertex;
    Eigen::Vector3f normal;
    for (int k = 0; k < 3; ++k) {
        const auto at = static_cast<std::size_t>(k);
        vertex.position[at] = a.position[at] + share * (b.position[at] - a.position[at]);
        normal[k] = a.normal[at] + b.normal[at];
    }
    normal.normalize();  // stays 0 where it is
    for (int k = 0; k < 3; ++k) vertex.normal[static_cast<std::size_t>(k)] = normal[k];
    return vertex;
}

/// Collapsing edges may leave sides that four triangles or more share: walls that touch. One pair
/// of them keeps the side, others get a vertex of their own on it. Nothing moves.
/// @param begin  the first triangle of the part
/// @param added  vertices that follow those of the mesh
void part_shared_sides(const Mesh& mesh, std::size_t begin, std::vector<Triangle>& triangles,
                       std::vector<Vertex>& added) {
    const std::size_t before = mesh.positions().size();
    const auto vertex_of = [&](std::uint32_t v) {
        return v < before ? Vertex{mesh.positions()[v], mesh.normals()[v]} : added[v - before];
    };
    bool again = true;
    for (int round = 0; again; ++round) {
        again = false;
        const std::vector<Side> sides = sides_of(triangles, begin);
        std::vector<bool> divided(triangles.size());
        for (auto first = sides.begin(), end = first; first != sides.end(); first = end) {
            while (end != sides.end() && end->same_place(*first)) ++end;
            if (end - first <= 2) continue;
            const auto [up, down] = pair_of({first, end}, divided);
            if (up == nullptr) continue;
            const auto vertex = static_cast<std::uint32_t>(before + added.size());
            const float share = 1.0F / static_cast<float>(2 + round);  // elsewhere each time
            added.push_back(between(vertex_of(up->low), vertex_of(up->high), share));
            for (const Side* side : {up, down}) {
                divide(triangles, *side, vertex);
                divided[side->triangle] = again = true;
            }
        }
    }
}
#endif

/// Neighbours of vertices, one vertex after another.
struct Neighbours {
    std::vector<std::uint64_t> start;
    std::vector<std::uint32_t> of;
    std::vector<bool> border;  // a side without another triangle
};

Neighbours neighbours_of(const Mesh& mesh) {
    const std::size_t count = mesh.positions().size();
    Neighbours all{std::vector<std::uint64_t>(count + 1), {}, std::vector<bool>(count)};
    for (const Triangle& t : mesh.triangles())
        for (const std::uint32_t v : t) all.start[v + 1] += 2;
    std::partial_sum(all.start.begin(), all.start.end(), all.start.begin());
    all.of.resize(all.start.back());
    std::vector<std::uint64_t> next(all.start.begin(), all.start.end() - 1);
    for (const Triangle& t : mesh.triangles())
        for (std::size_t k = 0; k < 3; ++k)
            for (const std::size_t other : {(k + 1) % 3, (k + 2) % 3})
                all.of[next[t[k]]++] = t[other];
    // Within the surface each neighbour comes twice.
    for (std::size_t v = 0; v < count; ++v) {
        const auto begin = all.of.begin() + static_cast<std::ptrdiff_t>(all.start[v]),
                   end = all.of.begin() + static_cast<std::ptrdiff_t>(all.start[v + 1]);
        std::sort(begin, end);
        for (auto at = begin; at != end; at += 2)
            if (at + 1 == end || at[0] != at[1]) {
                all.border[v] = true;
                break;
            }
    }
    return all;
}

void take_normals_of_triangles(Mesh& mesh) {
    std::vector<Eigen::Vector3d> sums(mesh.positions().size(), Eigen::Vector3d(0, 0, 0));
    for (const Triangle& t : mesh.triangles()) {
        const Eigen::Vector3d a = place(mesh, t[0]);
        const Eigen::Vector3d twice = (place(mesh, t[1]) - a).cross(place(mesh, t[2]) - a);
        for (const std::uint32_t v : t) sums[v] += twice;
    }
    for (std::size_t v = 0; v < sums.size(); ++v) {
        const double length = sums[v].norm();
        if (!(length > 0)) continue;
        for (std::size_t k = 0; k < 3; ++k)
            mesh.normals()[v][k] = static_cast<float>(sums[v][static_cast<int>(k)] / length);
    }
}

}  // namespace

Mesh largest_part(const Mesh& mesh, std::pmr::memory_resource* memory) {
    const std::vector<std::uint32_t> part = parts_of(mesh);
    std::vector<double> area(part.size());
    for (const Triangle& t : mesh.triangles()) {
        const Eigen::Vector3d a = place(mesh, t[0]);
        area[part[t[0]]] += (place(mesh, t[1]) - a).cross(place(mesh, t[2]) - a).norm() / 2;
    }
    // Of each group its largest part; the first triangle decides between equal ones.
    std::vector<std::uint32_t> best(std::max<std::size_t>(1, mesh.labels.size()), kUnused);
    for (std::size_t t = 0; t < mesh.triangles().size(); ++t) {
        std::uint32_t& of = best[group_of(mesh, t)];
        const std::uint32_t here = part[mesh.triangles()[t][0]];
        if (of == kUnused || area[here] > area[of]) of = here;
    }
    std::vector<Triangle> kept;
    std::vector<std::uint32_t> groups;
    for (std::size_t t = 0; t < mesh.triangles().size(); ++t) {
        const Triangle& triangle = mesh.triangles()[t];
        if (part[triangle[0]] != best[group_of(mesh, t)]) continue;
        kept.push_back(triangle);
        if (!mesh.groups().empty()) groups.push_back(mesh.groups()[t]);
    }
    return mesh_of(mesh, kept, groups, memory);
}

#ifdef EDGEWISE_MESHOPTIMIZER
bool can_decimate() noexcept { return true; }

Mesh decimated(const Mesh& mesh, double share, std::pmr::memory_resource* memory) {
    std::vector<std::uint32_t> order(mesh.triangles().size());
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return group_of(mesh, a) < group_of(mesh, b);
    });
    std::vector<std::uint32_t> local(mesh.positions().size(), kUnused), groups;
    std::vector<Triangle> part, out;
    std::vector<Vertex> added;
    for (std::size_t begin = 0; begin < order.size();) {
        const std::uint32_t group = group_of(mesh, order[begin]);
        part.clear();
        for (; begin < order.size() && group_of(mesh, order[begin]) == group; ++begin)
            part.push_back(mesh.triangles()[order[begin]]);
        const std::size_t here = out.size();
        decimate_part(mesh, share, part, local, out);
        part_shared_sides(mesh, here, out, added);
        if (!mesh.groups().empty()) groups.resize(out.size(), group);
    }
    return mesh_of(mesh, out, groups, memory, added);
}
#else
bool can_decimate() noexcept { return false; }

Mesh decimated(const Mesh&, double, std::pmr::memory_resource*) {
    throw RunError(
        message("@decimate: this build was made without meshoptimizer (libmeshoptimizer-dev)"));
}
#endif

Mesh smoothed(const Mesh& from, double share, std::pmr::memory_resource* memory) {
    // Taubin's pass band 0.1: 1 / 0.5 - 1 / 0.526 = 0.1.
    constexpr double kForwards = 0.5, kBackwards = -0.526;
    constexpr int kMostRounds = 20;
    const int rounds = static_cast<int>(std::lround(share * kMostRounds));
    Mesh mesh = mesh_of(from, {from.triangles().begin(), from.triangles().end()},
                        {from.groups().begin(), from.groups().end()}, memory);
    if (rounds == 0 || mesh.triangles().empty()) return mesh;
    const Neighbours all = neighbours_of(mesh);
    const std::size_t count = mesh.positions().size();
    std::vector<Eigen::Vector3d> at(count), to(count);
    for (std::size_t v = 0; v < count; ++v) at[v] = place(mesh, static_cast<std::uint32_t>(v));
    for (int step = 0; step < 2 * rounds; ++step) {
        const double by = step % 2 == 0 ? kForwards : kBackwards;
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 1 << 12),
                          [&](const auto& some) {
                              for (std::size_t v = some.begin(); v != some.end(); ++v) {
                                  const std::uint64_t begin = all.start[v], end = all.start[v + 1];
                                  to[v] = at[v];
                                  if (begin == end || all.border[v]) continue;
                                  Eigen::Vector3d sum(0, 0, 0);
                                  for (std::uint64_t i = begin; i < end; ++i) sum += at[all.of[i]];
                                  to[v] += by * (sum / static_cast<double>(end - begin) - at[v]);
                              }
                          });
        std::swap(at, to);
    }
    for (std::size_t v = 0; v < count; ++v)
        for (std::size_t k = 0; k < 3; ++k)
            mesh.positions()[v][k] = static_cast<float>(at[v][static_cast<int>(k)]);
    take_normals_of_triangles(mesh);
    return mesh;
}

double finishing_bytes(double vertices, double triangles) noexcept {
    // Copies of places and indices, the simplifier's quadrics, neighbours and edges.
    return 200 * vertices + 120 * triangles;
}

}  // namespace edgewise::surface
