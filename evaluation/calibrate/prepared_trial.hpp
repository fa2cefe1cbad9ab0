#pragma once

#include <vector>

#include "engine/looked.hpp"
#include "engine/planned.hpp"
#include "evaluation/calibrate/calibration_trials.hpp"
#include "graph/plan.hpp"

namespace edgewise {

/// What a trial's request may say, of its view or its window, is of no use to who calibrates: only
/// its end and its memory are between them.
class TrialListener final : public Listener {
 public:
    explicit TrialListener(Listener& to) : to_(to) {}

    const std::atomic<bool>& stop() const noexcept override { return to_.stop(); }
    void memory_opened(double bytes) override { to_.memory_opened(bytes); }
    void begins(State state) override { to_.begins(state); }
    void ends(State state) override { to_.ends(state); }

 private:
    Listener& to_;
};

/// A request whose input is the phantom's samples in the trial's type.
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

    TrialListener told;
    const Looked looked;
};

}  // namespace edgewise
