#pragma once

#include <cstdint>

#include "graph/samples.hpp"

namespace edgewise::kernels {

/// Samples along each side of a brick.
inline constexpr std::int64_t kBrickSide = 4;

/// Ranges of the finite samples of bricks [stored number], with room for kSlack bytes more; none:
/// low > high.
struct BrickRanges {
    float* low;   // [ceil(n / 4)]
    float* high;  // the same
};

/// Ranges of a line of bricks, whose samples lie in rows along x.
/// @param type   u8, i8, u16, i16 or f32
/// @param rows   of n samples each, with kSlack readable bytes behind the last one
/// @param count  rows, at least 1
void brick_rows(Type type, const void* const* rows, int count, std::int64_t n, BrickRanges ranges);

}  // namespace edgewise::kernels
