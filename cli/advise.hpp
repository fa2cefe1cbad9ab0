#pragma once

#include <vector>

#include "planner/advise.hpp"

namespace edgewise::cli {

/// A cost over several requests: regrets added, the longest measurement.
struct AdvisedCost {
    CostAdvice advice;
    int requests = 0;  // that it matters to
};

/// A missing edge over several requests, by the kinds that it joins; shown where it brings most.
struct AdvisedArc {
    ArcAdvice advice;
    int requests = 0;
    double gain = 0;  // [s], of all of them
};

struct Summary {
    std::vector<AdvisedCost> costs;  // most regret removed a second of measuring first
    std::vector<AdvisedArc> arcs;    // largest gain first
    int measured = 0, idle = 0;
};

/// Of one request its advice, else joined.
Summary summary_of(const std::vector<Advice>& all);

}  // namespace edgewise::cli
