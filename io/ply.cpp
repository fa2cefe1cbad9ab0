#include "io/ply.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fmt/format.h>

#include "io/file.hpp"
#include "io/file_buffer.hpp"

namespace edgewise::store {
namespace {

/// How the label of a triangle is written: PLY has integers of 32 bits, and f64.
enum class Labelled { whole, number, place };

Labelled labelled_as(std::span<const SurfaceLabel> labels) {
    const auto all = [&](auto test) { return std::all_of(labels.begin(), labels.end(), test); };
    if (!all([](const SurfaceLabel& label) { return label.exact; })) return Labelled::place;
    return all([](const SurfaceLabel& label) {
        return label.value == std::floor(label.value) && std::abs(label.value) <= 0x7fffffff;
    })
               ? Labelled::whole
               : Labelled::number;
}

/// A comment is one line.
std::string in_a_line(std::string text) {
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c >= 0 && c < ' '; }, ' ');
    return text;
}

/// Names of labels; what the places stand for, where labels are no numbers of PLY.
std::string comments_of(const SurfaceView& surface, Labelled as) {
    std::string text;
    if (as == Labelled::place)
        text += "comment labels have 64 bits: the label of a triangle is the first number below\n";
    for (std::size_t i = 0; i < surface.labels.size(); ++i) {
        const SurfaceLabel& label = surface.labels[i];
        std::string name = in_a_line(label.name);
        if (!name.empty()) name.insert(name.begin(), ' ');
        if (as == Labelled::place)
            text += fmt::format("comment label {} {}{}\n", i, label.id, name);
        else if (!name.empty())
            text += fmt::format("comment label {}{}\n", label.id, name);
    }
    return text;
}

std::string head_of(const SurfaceView& surface, Labelled as) {
    std::string head = "ply\nformat binary_little_endian 1.0\ncomment edgewise\n";
    if (surface.anatomical) head += "comment x to the left, y to the back, z to the head (LPS)\n";
    if (!surface.unit.empty()) head += fmt::format("comment unit {}\n", surface.unit);
    head += comments_of(surface, as);
    head += fmt::format("element vertex {}\n", surface.positions.size());
    for (const char* name : {"x", "y", "z"})
        head += fmt::format("property {} {}\n", surface.is_far() ? "double" : "float", name);
    for (const char* name : {"nx", "ny", "nz"}) head += fmt::format("property float {}\n", name);
    head += fmt::format("element face {}\nproperty list uchar int vertex_indices\n",
                        surface.triangles.size());
    if (!surface.groups.empty())
        head += fmt::format("property {} label\n", as == Labelled::number ? "double" : "int");
    if (surface.coloured)
        for (const char* name : {"red", "green", "blue"})
            head += fmt::format("property uchar {}\n", name);
    return head + "end_header\n";
}

}  // namespace

void write_ply(const std::string& path, const SurfaceView& surface) {
    static_assert(std::endian::native == std::endian::little);
    const Labelled as = labelled_as(surface.labels);
    Replacement file(path);
    FileBuffer out(file);
    out.add(std::string_view(head_of(surface, as)));
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
        const std::uint32_t group = surface.groups[t];
        const SurfaceLabel& label = surface.labels[group];
        if (as == Labelled::number)
            out.add(label.value);
        else
            out.add(as == Labelled::place ? static_cast<std::int32_t>(group)
                                          : static_cast<std::int32_t>(label.value));
        if (!surface.coloured) continue;
        for (const double part : label.color) out.add(static_cast<std::uint8_t>(255 * part + 0.5));
    }
    out.flush();
    file.commit();
}

}  // namespace edgewise::store
