#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace edgewise::store {

/// Triangles to be written, seen from outside counter-clockwise.
struct SurfaceView {
    std::span<const std::array<float, 3>> positions, normals;  // as many
    std::span<const std::array<std::uint32_t, 3>> triangles;   // of positions
    std::span<const std::uint32_t> groups;                     // of triangles; empty: none
    std::span<const double> labels;                            // of groups
    std::string unit;                                          // "mm", or ""
    bool anatomical = false;                                   // positions are in LPS
};

struct SurfaceFormat {
    std::string name;
    std::vector<std::string> endings;  // lower case, with the dot
    std::string note;
    void (*write)(const std::string& path, const SurfaceView& surface);
};
const std::vector<SurfaceFormat>& surface_formats();
/// The format of a path's ending, or none.
const SurfaceFormat* surface_format_of(std::string_view path);

/// Writes a surface in the format of the path's ending, under a name beside it that is renamed when
/// whole. Equal input gives equal bytes. At most 2^31 - 1 vertices and triangles.
/// @throws RequestError another ending
/// @throws RunError     disk full, folder that cannot be written
void write_surface(const std::string& path, const SurfaceView& surface);

}  // namespace edgewise::store
