#include "io/stl.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>

#include "io/file.hpp"
#include "io/file_buffer.hpp"

namespace edgewise::store {
namespace {

using Point = std::array<float, 3>;

/// Of length one, by the order of corners; 0 where there is no area.
Point normal_of(const Point& a, const Point& b, const Point& c) {
    std::array<double, 3> u, v;
    for (std::size_t i = 0; i < 3; ++i) u[i] = double(b[i]) - a[i], v[i] = double(c[i]) - a[i];
    const std::array<double, 3> n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                  u[0] * v[1] - u[1] * v[0]};
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (!(length > 0)) return {0, 0, 0};
    return {static_cast<float>(n[0] / length), static_cast<float>(n[1] / length),
            static_cast<float>(n[2] / length)};
}

}  // namespace

void write_stl(const std::string& path, const SurfaceView& surface) {
    Replacement file(path);
    FileBuffer out(file);
    // It must not begin with "solid", which says that text follows.
    std::array<char, 80> head{"edgewise"};
    if (surface.is_far()) {
        const auto& [x, y, z] = surface.offset;
        const std::string text = fmt::format("edgewise; add {:.17g} {:.17g} {:.17g}", x, y, z);
        std::copy_n(text.begin(), std::min(text.size(), head.size()), head.begin());
    }
    out.add(head);
    out.add(static_cast<std::uint32_t>(surface.triangles.size()));
    for (const auto& triangle : surface.triangles) {
        const Point &a = surface.positions[triangle[0]], &b = surface.positions[triangle[1]],
                    &c = surface.positions[triangle[2]];
        for (const Point& point : {normal_of(a, b, c), a, b, c}) out.add(point);
        out.add(std::uint16_t{0});
    }
    out.flush();
    file.commit();
}

}  // namespace edgewise::store
