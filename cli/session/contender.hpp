#pragma once

#include <optional>
#include <vector>

#include "cli/session/wisdom.hpp"
#include "graph/plan.hpp"

namespace edgewise::cli {

/// What a path is believed to take.
struct Belief {
    double seconds = 0;
    double spread = 0;  // standard deviation of the log
};

/// One path on trial in a pilot.
struct Contender {
    Plan plan;                     // of the whole request, as predicted
    std::vector<double> seconds;   // of its runs
    std::optional<Learned> known;  // error and bytes
    bool is_default = false, failed = false;

    /// Whether its runs are more than a few that may have met other load, or a processor that
    /// slept.
    bool is_timed() const;
    /// Whether it has runs enough.
    bool is_sure() const;

    /// Infinite where nothing was timed.
    double least() const;
    double typical() const;
    /// Runs and models, each as far as it is certain. Models are believed in how paths compare, not
    /// in how fast the machine is at the moment. Infinite where nothing was timed.
    /// @param level  runs over predictions, of all paths on trial
    Belief belief(double level) const;
    /// The low end of the predicted seconds.
    double low() const;

    /// Whether another run may show it to be faster than the best one. As long as it is not timed
    /// its runs say nothing against the models.
    bool is_close_to(const Contender& best) const;
};

}  // namespace edgewise::cli
