#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "graph/message.hpp"

namespace edgewise::store {

/// One of the labels that surfaces are around.
struct SurfaceLabel {
    double value = 0;
    std::string id;     // all digits of it
    bool exact = true;  // the value is the id
    std::string name;   // "": it has none
    std::array<double, 3> color{1, 1, 1};
};

/// Triangles to be written, seen from outside counter-clockwise.
struct SurfaceView {
    std::span<const std::array<float, 3>> positions, normals;  // as many
    std::span<const std::array<std::uint32_t, 3>> triangles;   // of positions
    std::span<const std::uint32_t> groups;                     // of triangles; empty: none
    std::span<const SurfaceLabel> labels;                      // of groups
    bool coloured = false;                                     // by their labels
    std::string unit;                                          // "mm", or ""
    bool anatomical = false;                                   // positions are in LPS
    /// Is added to all positions, in f64: PLY and OBJ then hold f64. STL has no such numbers; its
    /// header says what is to be added.
    std::array<double, 3> offset{0, 0, 0};

    bool is_far() const noexcept { return offset != std::array<double, 3>{0, 0, 0}; }
    std::array<double, 3> place(std::size_t vertex) const noexcept {
        const std::array<float, 3>& p = positions[vertex];
        return {p[0] + offset[0], p[1] + offset[1], p[2] + offset[2]};
    }
};

struct SurfaceFormat {
    std::string name;
    std::vector<std::string> endings;  // lower case, with the dot
    Message note;
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
