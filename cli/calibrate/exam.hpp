#pragma once

#include <vector>

#include "cli/calibrate/calibration_trials.hpp"
#include "planner/profile.hpp"

namespace edgewise::cli {

/// How far a profile misses what exams() take on all its processors: the logarithm of measured over
/// predicted seconds, for each path of at most 0.03 s. @throws Cancelled
std::vector<double> missed_in_exams(const Profile& profile, Phantoms& phantoms);

}  // namespace edgewise::cli
