#pragma once

#include <optional>
#include <vector>

#include "cli/machine/paced_runs.hpp"
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
    std::vector<double> seconds;   // that count
    PacedRuns runs;                // of this process
    std::optional<Learned> known;  // error and bytes
    double calm = 1;               // share of the calm runs that it takes to be sure
    bool is_default = false, failed = false;

    /// Which runs count, by the best pace so far.
    void choose(const Pace& best_pace);
    /// Whether its runs are more than a few that may have met other load, or a processor that
    /// slept.
    bool is_timed() const;
    /// Whether it has runs enough, and enough of them beside which no guest was busy.
    bool is_sure(const Pace& best_pace) const;

    /// Infinite where nothing was timed.
    double least() const;
    double median() const;
    /// Runs and models, each as far as it is certain: where no moment was calm the runs tell little
    /// more than how busy the host is. Infinite where nothing was timed.
    Belief belief() const;
    /// The low end of the predicted seconds.
    double low() const;

    /// Whether another run may show it to be faster than the best one. As long as it is not timed
    /// its runs say nothing against the models.
    bool is_close_to(const Contender& best) const;
};

}  // namespace edgewise::cli
