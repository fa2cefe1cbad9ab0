#pragma once

#include <vector>

#include "graph/plan.hpp"

namespace edgewise {

/// One run of one step: it makes vertex `step + 1` of the path at one of its placements.
struct Task {
    int step = 0;
    int first = 0;    // its regions run from this step on to `step`, box by box (Plan::boxes)
    int variant = 0;  // of the representation that it makes
    int view = 0;     // the first view of that variant
    int lane = 0;
    int input = -1;           // the task that makes what it reads, or -1: the source
    int readers = 0;          // tasks and frames that read what it makes
    std::vector<int> frames;  // delivered when it is done (tasks of the last step)
    std::vector<Region> regions;
    /// Box by box: for each region what its steps make, see boxes_read(). Else none.
    std::vector<std::vector<Region>> boxes;
    bool shared = false;  // tasks of other lanes read what it makes
};

/// A stretch of work that is admitted as a whole: the set-up, or one frame.
struct Lane {
    std::vector<int> tasks;  // in the order of the path
    double bytes = 0;        // most that is alive at once, with what it leaves for other lanes
};

/// What a plan does, before it becomes nodes. Lanes are in the order in which they are admitted:
/// frames that share an intermediate result follow each other.
struct Schedule {
    std::vector<Task> tasks;
    std::vector<Lane> lanes;
    std::vector<int> ready;  // frames that the source itself answers
};

/// @param frames  that are still to be made
Schedule schedule(const Plan& plan, const Ask& ask, const std::vector<int>& frames);

/// Bytes that one copy takes from the memory budget, with what stands around its samples.
double held_bytes(const Representation& what);

}  // namespace edgewise
