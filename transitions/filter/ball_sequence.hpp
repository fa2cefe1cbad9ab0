#pragma once

#include <cstdint>

#include "graph/small_objects.hpp"
#include "graph/transition.hpp"

namespace edgewise {

/// Elements that are dilated one after another in place of a disc or ball: a square or cube, then
/// lines along the diagonals, then crosses of radius 1. As wide along the axes as the ball.
struct BallSequence {
    int axes = 3;
    std::int64_t box = 0;      // radius of the square or cube
    std::int64_t face = 0;     // lines along (1, 1, 0) and its like reach so many steps each way
    std::int64_t body = 0;     // likewise along (1, 1, 1)
    std::int64_t crosses = 0;  // so many

    std::int64_t radius() const noexcept {
        return box + crosses + (axes == 2 ? 2 * face : 4 * (face + body));
    }
};

/// The sequence that comes closest to |k| <= radius.
/// @param radius  at least 1
/// @param axes    2 or 3
BallSequence ball_sequence(double radius, int axes);

/// Whether each place of the box of its radius belongs to what the sequence makes, x fastest.
SmallVector<std::uint8_t> places_of(const BallSequence& sequence);

/// Places that belong to either the ball or to what the sequence makes, but not to both: counted.
std::int64_t differing_places(const BallSequence& sequence, double radius);

/// Extremes over a flat ball by a sequence of small elements, an approximation: the result is
/// exactly that of the element that the sequence makes. Only `--via` brings it.
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Needs   dilation or erosion by sphere:R, R of 1 to 64, of volumes to 32; finite samples; no more
///         than `differs` of the ball's places differ, which are counted
/// Work    a comparison for each doubling of a line's length, 4 or 6 for each cross
/// Error   unknown: it depends on the samples; 0 where no place differs
/// Source  Adams, "Radial decomposition of discs and spheres", CVGIP 55(5), 1993; Jones and Soille,
///         "Periodic lines", Pattern Recognition Letters 17(10), 1996
Transition filter_ball_sequence();

}  // namespace edgewise
