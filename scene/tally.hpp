#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "graph/samples.hpp"

namespace edgewise {

/// A stretch of stored values, none of them mapped, of an Array: what stands readable behind it may
/// be loaded.
struct Stretched {
    Type type;
    const void* stored;  // the first value of all
    std::int64_t first, last;
};

struct Tally {
    double low, high;  // of finite values; low > high where there is none
    std::int64_t finite, equal;
};

/// Sums of a chunk. What is added to which lane, and when, does not depend on the processor: value
/// i of a stretch belongs to lane i % kLanes. Sums of types of up to 16 bits are exact and in the
/// first lane.
constexpr int kLanes = 16;
using LaneSums = std::array<double, kLanes>;

/// Rows of stored values: `row` in each, `rows` in each plane.
struct RowGrid {
    std::int64_t row, rows;
};

/// Adds a stretch up in one pass. Only the last one of a chunk may have a number of values that
/// kLanes does not divide.
/// @param common  what `equal` counts, a number of the stored type
Tally tally(const Stretched& values, double common, LaneSums& sums);

/// Adds to below[k] how many values of a type of up to 16 bits are less than bounds[k].
void count_below(const Stretched& values, std::span<const double> bounds,
                 std::span<std::int64_t> below);

/// Widens a box (x in stored values, not samples) by the values of the stretch that differ from
/// `common`. Of rows that the box meets already nothing is looked at but what lies beside it.
void widen(const Stretched& values, const RowGrid& grid, double common, Region& box);

/// The first value of the stretch that equals a number of the stored type, or `last`.
std::int64_t first_equal(const Stretched& values, double wanted);

}  // namespace edgewise
