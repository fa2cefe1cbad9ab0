#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "graph/plan.hpp"

namespace edgewise {

struct Planned;

/// Paths of a request that are worth running, all of them or a part.
struct TriedPaths {
    std::vector<Plan> plans;  // least predicted seconds first
    std::vector<bool> front;  // of each: no other is predicted better in seconds, bytes and error
    std::size_t all = 0;      // simple paths that there are, counted up to some thousand
};

/// The simple paths over the parameter values that the planner tries, under --via and --without;
/// budgets remove none. Where there are more than `limit`: what the planner chose, the front, its
/// neighbours (one step more, less or another), and a sample of the rest that depends on `seed`
/// alone.
/// @param only  where not empty: these (as path_text writes them) as far as they are there, and no
///              others, whatever the limit
TriedPaths tried_paths(const Planned& planned, std::size_t limit, std::uint64_t seed,
                       const std::set<std::string>& only = {});

/// The steps of a path as `--via` takes them, with " > " between them.
std::string path_text(const std::vector<std::string>& steps);

}  // namespace edgewise
