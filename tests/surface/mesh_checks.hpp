#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory_resource>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "graph/data.hpp"
#include "surface/mesh.hpp"

namespace edgewise::surface {

/// A volume of one type, from a function of the indices.
template <class T, class Value>
Data volume_of(const Extent& extent, Type type, Value value) {
    Representation what;
    what.extent = extent;
    what.type = type;
    Data data = Data::make(what, std::pmr::get_default_resource());
    T* out = data.as<T>();
    for (std::int64_t z = 0; z < extent.z; ++z)
        for (std::int64_t y = 0; y < extent.y; ++y)
            for (std::int64_t x = 0; x < extent.x; ++x) *out++ = static_cast<T>(value(x, y, z));
    return data;
}

/// Why a mesh is no closed 2-manifold: every side belongs to two triangles that pass it in opposite
/// directions, and the triangles at a vertex form one fan; "" where it is one.
inline std::string no_manifold(const Mesh& mesh) {
    using Side = std::pair<std::uint32_t, std::uint32_t>;
    std::map<Side, int> sides;
    std::vector<std::vector<Side>> opposite(mesh.positions().size());
    for (const Triangle& t : mesh.triangles())
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t a = t[i], b = t[(i + 1) % 3], c = t[(i + 2) % 3];
            if (a == b) return "a triangle has one vertex twice";
            if (++sides[{a, b}] > 1) return "a side is passed twice in one direction";
            opposite[a].emplace_back(b, c);
        }
    for (const auto& [side, count] : sides)
        if (!sides.contains({side.second, side.first})) return "a side has one triangle";
    for (const std::vector<Side>& fan : opposite) {
        if (fan.empty()) return "a vertex belongs to no triangle";
        const std::map<std::uint32_t, std::uint32_t> next(fan.begin(), fan.end());
        std::size_t steps = 0;
        std::uint32_t at = fan[0].first;
        do {
            at = next.at(at);
            ++steps;
        } while (at != fan[0].first);
        if (steps != fan.size()) return "the triangles at a vertex are several fans";
    }
    return {};
}

/// Vertices - edges + triangles of a closed mesh.
inline std::int64_t euler_number(const Mesh& mesh) {
    const auto triangles = static_cast<std::int64_t>(mesh.triangles().size());
    return static_cast<std::int64_t>(mesh.positions().size()) - triangles * 3 / 2 + triangles;
}

inline bool same_bytes(const Mesh& a, const Mesh& b) {
    const auto same = [](auto x, auto y) {
        return std::equal(x.begin(), x.end(), y.begin(), y.end());
    };
    return same(a.positions(), b.positions()) && same(a.normals(), b.normals()) &&
           same(a.triangles(), b.triangles()) && same(a.groups(), b.groups());
}

}  // namespace edgewise::surface
