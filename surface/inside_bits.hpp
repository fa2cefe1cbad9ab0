#pragma once

#include <cstdint>

#include "graph/samples.hpp"
#include "surface/level.hpp"

namespace edgewise::surface {

/// Words of one bit a sample that a row takes: one more than it fills, so that 64 bits can be
/// fetched from any place.
constexpr std::int64_t words_of_row(std::int64_t n) noexcept { return (n + 63) / 64 + 1; }

/// Which samples of a row are inside.
/// @param row   n numbers of a type that can be cut
/// @param bits  words_of_row(n) words; bits behind the last sample become 0
void inside_bits(const void* row, Type type, std::int64_t n, const Level& level,
                 std::uint64_t* bits) noexcept;

/// Whether all numbers of a row are finite.
bool all_finite(const float* row, std::int64_t n) noexcept;

}  // namespace edgewise::surface
