#pragma once

#include <memory>
#include <string>
#include <vector>

#include "graph/cost.hpp"
#include "graph/transition.hpp"

namespace edgewise {

/// One edge of a path, with what it is expected to take.
struct Step {
    std::shared_ptr<const Transition> by =
        {};  // shared with the catalogue, so a plan may outlive it
    Offer offer;
    Work work;            // mean over the views
    double seconds = 0;   // all its runs
    double scratch = 0;   // bytes in addition to input and output while it runs
    Label label;          // of the path up to and with this step
    Predicted predicted;  // of this step: its seconds, the peak while it runs, the error so far

    int runs() const noexcept { return offer.to.runs(); }
    /// "project.ray_cast/filter=foh/step=1", as `via` takes it.
    std::string text() const { return by->name + offer.with.text(); }
};

/// A path through the graph and what it is expected to take. The first step reads `source`.
struct Plan {
    Representation source;
    std::vector<Step> steps;  // empty: the source is what was asked for
    /// The number of boxes that the last steps make one after the other, so that no result between
    /// them is ever whole. These are the steps that know the region read for a region made
    /// (Partition::reads). 1: each step makes all before the next one begins.
    int boxes = 1;
    Label label;
    Predicted predicted;

    std::vector<std::string> texts() const {
        std::vector<std::string> all;
        for (const Step& step : steps) all.push_back(step.text());
        return all;
    }
};

/// The first of the last steps that run box by box: each makes a box of its output from a box of
/// its input, as often as the last step runs. steps.size() - 1 where the plan asks for no boxes.
int first_in_boxes(const Plan& plan, const Ask& ask);
/// The boxes that the steps from `first` on make for a region of the result, which is the last.
std::vector<Region> boxes_read(const Plan& plan, const Ask& ask, int first, const Region& region,
                               int view);

/// An edge that was accepted nowhere, and why.
struct Refusal {
    std::string transition;
    Message reason;
    bool asked = true;  // the reason is its own; else nothing made what it reads
};

}  // namespace edgewise
