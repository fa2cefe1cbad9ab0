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
    double gather = 0;  // [s] of a read where neighbouring reads share cache lines
    double line = 0;    // [s] of a read that has a cache line of its own
    double spread = 0;  // of these numbers: standard deviation of the log
};

/// From the smallest to the largest; no cost is below that of the level before. Empty: not known.
using Levels = std::vector<Level>;

/// What one access costs in a set of so many bytes. A set that a level holds costs what the level
/// does. A set of twice the bytes or more costs what the next level does. Between them the cost is
/// linear in the logarithm of the size, so it is continuous and never falls as the set grows.
///
/// Why not a jump: caches keep what was used last. They miss nearly all of a set that is read in
/// order and is a little too large, but only half of one that is read at random and is twice too
/// large.
/// @param levels  not empty
/// @param cost    &Level::streamed, &Level::gather or &Level::line
/// @param set     [byte]; 0: not known, so the last level's
double cost_in(const Levels& levels, double Level::*cost, double set) noexcept;

/// [s] of a cache-line miss, beyond a read that the first level serves, where all other lines of
/// the set are read before this one comes again. A cache that is a little too small keeps none of
/// such a set. `line` was measured on sets read at random, of which a cache keeps half when they
/// have twice its size. So a line costs what `line` says for a set of twice the bytes. It costs no
/// less than a part of the time of moving it in order.
/// @param levels  not empty
/// @param set     [byte]; 0: not known
double line_again(const Levels& levels, double set) noexcept;

nlohmann::json to_json(const Levels& levels);
/// @throws InputError naming the field; `file` is what messages call the text
Levels levels_of(const nlohmann::json& json, const std::string& file);

}  // namespace edgewise
