#pragma once

#include <cstddef>
#include <vector>

#include "charts/places.hpp"
#include "charts/scales.hpp"
#include "charts/table.hpp"

namespace edgewise::charts {

/// Where the axes of time against error lie in a picture [pixel], y down.
struct Frame {
    double left, top, right, bottom;
    const LogAxis &seconds, &error;

    Spot spot(double seconds_there, double error_there) const;
};

/// A number beside its mark.
struct FrontNumber {
    Spot spot;         // its middle
    bool far = false;  // too far to be seen as the mark's
};

/// Where the numbers 1, 2, ... of the front stand: off axes, marks, rings, peers, texts of budgets
/// and each other as far as there is room.
/// @param front  places in the table
/// @param most   numbers at most
std::vector<FrontNumber> front_numbers(const Table& table, const std::vector<std::size_t>& front,
                                       std::size_t most, const Frame& frame);

}  // namespace edgewise::charts
