#pragma once

#include <array>
#include <cstdint>

namespace edgewise::surface {

/// How a surface runs through a cell of 2 x 2 x 2 samples, for each set of corners that are inside.
///
/// Corner c lies at (c & 1, c >> 1 & 1, c >> 2). Edge 4 a + u + 2 v runs along axis a; u and v are
/// its places along the other two axes, in their order.
///
/// On each face the surface separates corners that are inside from those that are not. Where two
/// opposite corners of a face are inside and the others are not, the two are kept apart. That
/// depends on the four corners of the face alone, so both cells at a face cut it alike.
/// Each loop is a polygon through cut edges. Each cut edge belongs to one loop.
/// Loops become triangles by diagonals that lie in no face. So every side of a triangle belongs to
/// exactly two triangles, and the surface is a 2-manifold wherever samples lie, also where vertices
/// coincide.
struct CellCase {
    std::uint8_t triangles = 0;
    std::array<std::array<std::uint8_t, 3>, 5> corners{};  // cut edges

    std::uint8_t loops = 0;
    std::array<std::uint8_t, 12> loop_of{};  // by edge; kNone: not cut
    /// The face (2 axis + side) that one loop passes twice; kNone: there is none.
    std::uint8_t passed_twice = 0;
    static constexpr std::uint8_t kNone = 255;
};

/// By the set of corners that are inside, corner c being bit c.
const std::array<CellCase, 256>& cell_cases();
/// The loops where the corners of the face that a loop passes twice are joined instead; the same
/// as above for all other sets. Triangles are not filled in.
const std::array<CellCase, 256>& joined_cell_cases();

/// Corners at the two ends of an edge, the lower first.
constexpr std::array<std::uint8_t, 2> ends_of(int edge) noexcept {
    const int axis = edge / 4, u = edge & 1, v = edge >> 1 & 1;
    const int first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
    const int low = u << first | v << second;
    return {static_cast<std::uint8_t>(low), static_cast<std::uint8_t>(low | 1 << axis)};
}

}  // namespace edgewise::surface
