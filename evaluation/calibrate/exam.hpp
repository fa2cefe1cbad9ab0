#pragma once

#include <vector>

#include "engine/listener.hpp"
#include "evaluation/calibrate/calibration_trials.hpp"
#include "planner/profile.hpp"

namespace edgewise {

/// How far a profile misses what the exams of edges (Trial::Part) take on all its processors: the
/// logarithm of measured over predicted seconds, for each path of at most 0.03 s. @throws Cancelled
std::vector<double> missed_in_exams(const Profile& profile, Phantoms& phantoms,
                                    const Catalogue& edges, Listener& listener);

}  // namespace edgewise
