#pragma once

#include <optional>
#include <vector>

#include "engine/wisdom.hpp"
#include "graph/plan.hpp"

namespace edgewise {

/// What a path is expected to take, from runs and predictions together.
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

    /// Whether it has a few runs at least: one or two may have met other load, or a processor that
    /// slept.
    bool is_timed() const;
    /// Whether it has runs enough.
    bool is_sure() const;

    /// The shortest run, and the time that its runs stand for. Infinite where nothing was timed.
    double least() const;
    double typical() const;
    /// Runs and prediction, weighed by their spread. Predictions say how paths compare, not how
    /// fast the machine is at the moment. Infinite where nothing was timed.
    /// @param level  measured over predicted seconds, in the median of all paths on trial
    Belief belief(double level) const;
    /// The low end of the predicted seconds.
    double low() const;

    /// Whether another run may show it to be faster than the best one. Until it is timed its runs
    /// do not count against its prediction.
    bool is_close_to(const Contender& best) const;
};

}  // namespace edgewise
