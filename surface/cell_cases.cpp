#include "surface/cell_cases.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace edgewise::surface {
namespace {

constexpr int kEdges = 12, kFaces = 6;
using Polygon = std::vector<int>;  // edges, in order
using Triangles = std::vector<std::array<int, 3>>;

/// Corners of a face, counter-clockwise seen from outside the cell.
std::array<int, 4> ring_of(int face) {
    const int axis = face / 2, side = face % 2;
    const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3;
    std::array<int, 4> ring{0, u, u | v, v};
    for (int& corner : ring) corner |= side << axis;
    if (side == 0) std::reverse(ring.begin(), ring.end());
    return ring;
}

int edge_between(int a, int b) {
    for (int edge = 0; edge < kEdges; ++edge) {
        const auto ends = ends_of(edge);
        if ((ends[0] == a && ends[1] == b) || (ends[0] == b && ends[1] == a)) return edge;
    }
    return -1;
}

/// Edges of a face, each behind its corner in the ring.
std::array<int, 4> edges_of(int face) {
    const std::array<int, 4> ring = ring_of(face);
    std::array<int, 4> edges;
    for (int i = 0; i < 4; ++i) edges[i] = edge_between(ring[i], ring[(i + 1) % 4]);
    return edges;
}

bool in_one_face(int a, int b) {
    for (int face = 0; face < kFaces; ++face) {
        const auto edges = edges_of(face);
        if (std::count(edges.begin(), edges.end(), a) && std::count(edges.begin(), edges.end(), b))
            return true;
    }
    return false;
}

/// From each cut edge of a face to the next one of its loop, such that loops go counter-clockwise
/// seen from outside the surface.
/// @param joined  opposite corners that are inside are joined, and not kept apart
void connect(int set, int face, bool joined, std::array<int, kEdges>& next) {
    const std::array<int, 4> ring = ring_of(face), edges = edges_of(face);
    const auto inside = [&](int i) { return (set >> ring[i % 4] & 1) != 0; };
    for (int i = 0; i < 4; ++i) {
        if (inside(i) || !inside(i + 1)) continue;
        // Edge i leads into a run of corners that are inside; this is where a run ends.
        int end = i + 1;
        while (inside(end + 1)) ++end;
        if (joined && end == i + 1 && inside(i + 3)) end = i + 3;
        next[edges[i]] = edges[end % 4];
    }
}

std::vector<Polygon> loops_of(int set, int joined_face) {
    std::array<int, kEdges> next;
    next.fill(-1);
    for (int face = 0; face < kFaces; ++face) connect(set, face, face == joined_face, next);
    std::vector<Polygon> loops;
    for (int edge = 0; edge < kEdges; ++edge) {
        Polygon loop;
        for (int at = edge; next[at] >= 0;) {
            loop.push_back(at);
            const int from = at;
            at = next[at];
            next[from] = -1;
        }
        if (!loop.empty()) loops.push_back(std::move(loop));
    }
    return loops;
}

/// Cuts a polygon by diagonals that lie in no face, and adds its triangles.
/// @return whether that can be done
bool cut(const Polygon& polygon, Triangles& into) {
    if (polygon.size() < 3) return true;
    const int first = polygon.front(), last = polygon.back();
    const std::size_t had = into.size();
    for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
        const int middle = polygon[k];
        const bool cuts_before = k > 1, cuts_behind = k + 2 < polygon.size();
        if ((cuts_before && in_one_face(first, middle)) ||
            (cuts_behind && in_one_face(middle, last)))
            continue;
        const auto at = polygon.begin() + static_cast<std::ptrdiff_t>(k);
        if (cut(Polygon(polygon.begin(), at + 1), into) && cut(Polygon(at, polygon.end()), into)) {
            into.push_back({first, middle, last});
            return true;
        }
        into.resize(had);
    }
    return false;
}

std::uint8_t face_passed_twice(const std::vector<Polygon>& loops) {
    for (int face = 0; face < kFaces; ++face) {
        const auto edges = edges_of(face);
        for (const Polygon& loop : loops)
            if (std::all_of(edges.begin(), edges.end(), [&](int edge) {
                    return std::count(loop.begin(), loop.end(), edge) > 0;
                }))
                return static_cast<std::uint8_t>(face);
    }
    return CellCase::kNone;
}

void take_loops(CellCase& cell, const std::vector<Polygon>& loops) {
    cell.loops = static_cast<std::uint8_t>(loops.size());
    cell.loop_of.fill(CellCase::kNone);
    for (std::size_t i = 0; i < loops.size(); ++i)
        for (const int edge : loops[i]) cell.loop_of[edge] = static_cast<std::uint8_t>(i);
}

std::array<CellCase, 256> made_cases() {
    std::array<CellCase, 256> cases;
    for (int set = 0; set < 256; ++set) {
        CellCase& cell = cases[set];
        const std::vector<Polygon> loops = loops_of(set, -1);
        take_loops(cell, loops);
        cell.passed_twice = face_passed_twice(loops);
        Triangles triangles;
        for (const Polygon& loop : loops) cut(loop, triangles);  // all loops of all sets can be cut
        for (const auto& triangle : triangles)
            cell.corners[cell.triangles++] = {static_cast<std::uint8_t>(triangle[0]),
                                              static_cast<std::uint8_t>(triangle[1]),
                                              static_cast<std::uint8_t>(triangle[2])};
    }
    return cases;
}

std::array<CellCase, 256> made_joined_cases() {
    std::array<CellCase, 256> cases = cell_cases();
    for (int set = 0; set < 256; ++set)
        if (cases[set].passed_twice != CellCase::kNone)
            take_loops(cases[set], loops_of(set, cases[set].passed_twice));
    return cases;
}

}  // namespace

const std::array<CellCase, 256>& cell_cases() {
    static const std::array<CellCase, 256> cases = made_cases();
    return cases;
}

const std::array<CellCase, 256>& joined_cell_cases() {
    static const std::array<CellCase, 256> cases = made_joined_cases();
    return cases;
}

}  // namespace edgewise::surface
