#include "io/obj.hpp"

#include <algorithm>
#include <cstdint>
#include <fmt/compile.h>
#include <fmt/format.h>
#include <iterator>
#include <vector>

#include "io/file.hpp"
#include "io/file_buffer.hpp"

namespace edgewise::store {
namespace {

/// Triangles group by group; within a group in order.
std::vector<std::uint32_t> grouped(const SurfaceView& surface) {
    std::vector<std::uint32_t> order(surface.triangles.size());
    std::vector<std::size_t> next(surface.labels.size() + 1);
    for (const std::uint32_t group : surface.groups) ++next[group + 1];
    for (std::size_t i = 1; i < next.size(); ++i) next[i] += next[i - 1];
    for (std::size_t t = 0; t < order.size(); ++t)
        order[next[surface.groups[t]]++] = static_cast<std::uint32_t>(t);
    return order;
}

}  // namespace

void write_obj(const std::string& path, const SurfaceView& surface) {
    Replacement file(path);
    FileBuffer out(file);
    fmt::memory_buffer line;
    const auto add = [&](auto format, const auto&... values) {
        line.clear();
        fmt::format_to(std::back_inserter(line), format, values...);
        out.add(std::string_view(line.data(), line.size()));
    };
    out.add(std::string_view("# edgewise\n"));
    if (surface.anatomical)
        out.add(std::string_view("# x to the left, y to the back, z to the head (LPS)\n"));
    if (!surface.unit.empty()) add(FMT_COMPILE("# unit {}\n"), surface.unit);
    // The shortest text that reads as the same number.
    const auto add_place = [&](const auto& p) {
        add(FMT_COMPILE("v {} {} {}\n"), p[0], p[1], p[2]);
    };
    for (std::size_t v = 0; v < surface.positions.size(); ++v)
        if (surface.is_far())
            add_place(surface.place(v));
        else
            add_place(surface.positions[v]);
    for (const auto& n : surface.normals) add(FMT_COMPILE("vn {} {} {}\n"), n[0], n[1], n[2]);
    const auto add_triangle = [&](const std::array<std::uint32_t, 3>& t) {
        // Counted from 1.
        add(FMT_COMPILE("f {0}//{0} {1}//{1} {2}//{2}\n"), t[0] + 1, t[1] + 1, t[2] + 1);
    };
    if (surface.groups.empty())
        for (const auto& triangle : surface.triangles) add_triangle(triangle);
    else {
        std::uint32_t group = ~std::uint32_t{0};
        for (const std::uint32_t t : grouped(surface)) {
            if (surface.groups[t] != group) {
                group = surface.groups[t];
                const SurfaceLabel& label = surface.labels[group];
                if (!label.name.empty()) {
                    std::string name = label.name;
                    std::replace_if(
                        name.begin(), name.end(), [](char c) { return c >= 0 && c < ' '; }, ' ');
                    add(FMT_COMPILE("# label_{}: {}\n"), label.id, name);
                }
                add(FMT_COMPILE("g label_{}\n"), label.id);
            }
            add_triangle(surface.triangles[t]);
        }
    }
    out.flush();
    file.commit();
}

}  // namespace edgewise::store
