#pragma once

#include <optional>
#include <string>
#include <vector>

#include "planner/profile.hpp"

namespace edgewise {

/// Names of the profiles that come with the library (planner/machines/NAME.json): the machines of
/// [W93], fitted to a part of its tables by benchmarks/fit_thesis_machines.py, and a cluster that
/// nobody has built.
std::vector<std::string> bundled_machines();
/// One of them, or nothing.
std::optional<Profile> bundled_profile(const std::string& name);

}  // namespace edgewise
