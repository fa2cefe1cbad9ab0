#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace edgewise::charts {

/// A place of a drawing [pixel], x right, y down.
struct Spot {
    double x = 0, y = 0;
};

/// What a text should not lie on: of little weight where only looks suffer.
struct Obstacle {
    double left, top, right, bottom;  // [pixel]
    double weight = 1;
};

/// Room that texts may take, and what is in it.
struct Room {
    double left, top, right, bottom;  // [pixel]
    std::vector<Obstacle> obstacles;
};

/// The middles of short texts, each as near to its anchor as earlier marks allow; one after the
/// other, so that a text keeps off all earlier ones. No text leaves the room.
/// @param widths  of the texts [pixel], one an anchor
/// @param height  of every text [pixel]
std::vector<Spot> places_beside(std::span<const Spot> anchors, std::span<const double> widths,
                                double height, Room room);

/// The same values moved as little as it takes for neighbours to be `apart`, in their order; within
/// `low` and `high` as far as there is room.
std::vector<double> spread(std::span<const double> values, double apart, double low, double high);

}  // namespace edgewise::charts
