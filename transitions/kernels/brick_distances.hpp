#pragma once

#include <cstdint>
#include <limits>
#include <memory_resource>
#include <vector>

#include "transitions/kernels/ray_cast.hpp"

namespace edgewise::kernels {

/// Of each brick of 4^3 samples how many bricks away, along the axis where that is most, the
/// nearest one lies that may matter (proximity clouds: Cohen and Sheffer 1994). 0: it may itself.
struct BrickDistances {
    static constexpr int kMost = 127;

    const Bricks* bricks = nullptr;
    std::pmr::vector<std::uint8_t> distance;
    /// Levels no greater never matter. For a MIP: the least value that all rays have already.
    float floor = -std::numeric_limits<float>::infinity();

    /// Single-threaded: two bytes are read and written a brick.
    /// @param least  the floor
    /// @param most   no distance is larger, up to kMost
    BrickDistances(const Bricks& of, float least, int most, std::pmr::memory_resource* memory);
};

}  // namespace edgewise::kernels
