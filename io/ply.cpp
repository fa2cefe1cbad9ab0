#include "io/ply.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fmt/format.h>

#include "io/file.hpp"
#include "io/file_buffer.hpp"

namespace edgewise::store {
namespace {

/// Whether labels are whole numbers of 32 bits.
bool are_whole(std::span<const double> labels) {
    return std::all_of(labels.begin(), labels.end(), [](double label) {
        return label == std::floor(label) && std::abs(label) <= 0x7fffffff;
    });
}

std::string head_of(const SurfaceView& surface, bool whole) {
    std::string head = "ply\nformat binary_little_endian 1.0\ncomment edgewise\n";
    if (surface.anatomical) head += "comment x to the left, y to the back, z to the head (LPS)\n";
    if (!surface.unit.empty()) head += fmt::format("comment unit {}\n", surface.unit);
    head += fmt::format("element vertex {}\n", surface.positions.size());
    for (const char* name : {"x", "y", "z"})
        head += fmt::format("property {} {}\n", surface.is_far() ? "double" : "float", name);
    for (const char* name : {"nx", "ny", "nz"}) head += fmt::format("property float {}\n", name);
    head += fmt::format("element face {}\nproperty list uchar int vertex_indices\n",
                        surface.triangles.size());
    if (!surface.groups.empty())
        head += fmt::format("property {} label\n", whole ? "int" : "double");
    return head + "end_header\n";
}

}  // namespace

void write_ply(const std::string& path, const SurfaceView& surface) {
    static_assert(std::endian::native == std::endian::little);
    const bool whole = are_whole(surface.labels);
    Replacement file(path);
    FileBuffer out(file);
    out.add(std::string_view(head_of(surface, whole)));
    for (std::size_t v = 0; v < surface.positions.size(); ++v) {
        if (surface.is_far())
            out.add(surface.place(v));
        else
            out.add(surface.positions[v]);
        out.add(surface.normals[v]);
    }
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        out.add(std::uint8_t{3});
        out.add(surface.triangles[t]);
        if (surface.groups.empty()) continue;
        const double label = surface.labels[surface.groups[t]];
        if (whole)
            out.add(static_cast<std::int32_t>(label));
        else
            out.add(label);
    }
    out.flush();
    file.commit();
}

}  // namespace edgewise::store
