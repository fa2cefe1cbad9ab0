#pragma once

#include <optional>
#include <string>
#include <vector>

#include "planner/candidates.hpp"

namespace edgewise {

/// How much slower a step of the plan may get.
struct StepMargin {
    std::string step = {};                  // as `--via` takes it; wherever paths take it
    std::optional<double> factor = {};      // on its seconds, from which on another plan is chosen
    std::vector<std::string> instead = {};  // the steps of that plan; empty: none is left
    double spread = 0;    // of its predicted seconds: standard deviation of the log
    bool inside = false;  // the factor is no larger than this spread
};

/// A path that was not chosen, against the plan.
struct Rival {
    std::vector<std::string> steps = {};
    Predicted predicted = {};
    double seconds = 0, bytes = 0;            // more than the plan; below 0: less
    std::optional<double> error = {};         // likewise; none where one of the two is not known
    std::vector<std::string> breaks = {};     // budgets: "error", "time", "memory"
    std::optional<std::string> differs = {};  // its first step that the plan has not at this place
    std::optional<double> faster = {};        // by which that must get before the rival is chosen
    double chance = 0;     // that it is the faster one, by the spread of the steps that differ
    bool toss_up = false;  // that chance is above 16 %, one standard deviation
};

struct Margin {
    std::vector<StepMargin> steps;
    std::vector<Rival> rivals;  // those within the budgets first, the nearest first
    double late = 0;            // chance that the plan takes more than the budget of seconds
    bool toss_up = false;       // some rival within the budgets is one
};

/// How sure a choice is, for a plan among `paths`; empty where it is none of them.
/// @param rivals  that are wanted; there are fewer where there are fewer paths
Margin margin_of(const Candidates& paths, const Plan& plan, std::size_t rivals = 4);

}  // namespace edgewise
