#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "graph/data.hpp"

namespace edgewise {

/// Bricks of samples in which something varies, drawn from all over the data.
struct VaryingBricks {
    using Lengths = std::array<std::int64_t, 3>;

    Lengths brick;  // samples along x, y, z: 32^3 of a volume, 128^2 of an image, or less
    std::vector<Lengths> first;  // the first sample of each, at most kMost
    int empty = 0;               // bricks looked at in which nothing varies
    std::int64_t samples = 0;    // looked at, those of one brick in all channels counted whole

    static constexpr int kMost = 16;
    static constexpr std::int64_t kSide = 32, kSideOfImages = 128;
};

/// Looks at 32 bricks that are spread over the data, the same ones for the same extent; where fewer
/// than 16 of them vary, at the others that reach into the occupied box, in random order, until 16
/// are found or none is left. A brick varies that has two different finite values in one channel.
/// Bricks tile the data; only where none varies, though the box is not empty, those are looked at
/// that lie half-way between them: so none is found only where all finite values are equal, or
/// differ from their neighbours through values that are not finite alone.
/// @param occupied  box outside of which all samples are equal
VaryingBricks varying_bricks(const Data& data, const Region& occupied);

}  // namespace edgewise
