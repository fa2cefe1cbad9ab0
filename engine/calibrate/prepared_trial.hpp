#pragma once

#include <vector>

#include "engine/calibrate/calibration_trials.hpp"
#include "engine/session.hpp"
#include "graph/plan.hpp"

namespace edgewise {

/// A session whose input is the phantom's samples in the trial's type.
struct PreparedTrial {
    /// @param phantoms  outlives it
    /// @param listener  likewise
    PreparedTrial(const Trial& trial, Phantoms& phantoms, const Catalogue& edges,
                  Listener& listener);
    PreparedTrial(const PreparedTrial&) = delete;
    PreparedTrial& operator=(const PreparedTrial&) = delete;

    /// All paths to the result, priced for a machine.
    std::vector<Plan> paths(const Profile& profile) const;
    /// Runs all frames and keeps none. @throws Cancelled
    Outcome run(const Plan& plan, int threads) const;

    Session session;
};

}  // namespace edgewise
