#pragma once

#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace edgewise {

/// A level of memory, and what an access costs that it serves.
struct Level {
    double bytes = std::numeric_limits<double>::infinity();  // it holds; the last one: no end
    double streamed = 0;                                     // [s/byte]
    double gather = 0;  // [s] where neighbours share the cache's lines
    double line = 0;    // [s] of one that shares its line with none
    double spread = 0;  // of these numbers: standard deviation of the log
};

/// From the smallest to the largest; no cost is below that of the level before. Empty: not known.
using Levels = std::vector<Level>;

/// What one access costs in a set of so many bytes. A set that a level holds takes that level's
/// cost, one of twice the bytes or more that of the next, and between them the cost grows linearly
/// with the logarithm of the size: continuous, and never falling as the set grows. Caches that keep
/// what was used last miss nearly all of a set that is read in order and is a little too large, and
/// half of one that is read anywhere and is twice too large: two sizes where one would jump.
/// @param levels  not empty
/// @param cost    &Level::streamed, &Level::gather or &Level::line
/// @param set     [byte]; 0: not known, so the last level's
double cost_in(const Levels& levels, double Level::*cost, double set) noexcept;

/// [s] beyond a near one that a line takes where all others of its set are read before it comes
/// again. A cache that is a little too small keeps none of such a set, but half of one of twice the
/// size that is read anywhere, as `line` was measured: so it costs what that does. No less than a
/// part of what the levels take to move it in order.
/// @param levels  not empty
/// @param set     [byte]; 0: not known
double line_again(const Levels& levels, double set) noexcept;

nlohmann::json to_json(const Levels& levels);
/// @throws InputError naming the field; `file` is what messages call the text
Levels levels_of(const nlohmann::json& json, const std::string& file);

}  // namespace edgewise
