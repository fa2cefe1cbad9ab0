#pragma once

#include <vector>

#include "cli/calibrate/calibration_trials.hpp"
#include "cli/session/session.hpp"
#include "graph/plan.hpp"

namespace edgewise::cli {

/// A session whose input is the phantom's samples in the trial's type.
struct PreparedTrial {
    /// @param phantoms  outlives it
    PreparedTrial(const Trial& trial, Phantoms& phantoms);
    PreparedTrial(const PreparedTrial&) = delete;
    PreparedTrial& operator=(const PreparedTrial&) = delete;

    /// All paths to the result, priced for a machine.
    std::vector<Plan> paths(const Profile& profile) const;
    /// Runs all frames and keeps none. @throws Cancelled
    Outcome run(const Plan& plan, int threads) const;

    JobOptions options;
    Session session;
};

}  // namespace edgewise::cli
