#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "graph/plan.hpp"
#include "runtime/memory_budget.hpp"

namespace edgewise {

/// One node that ran: for traces and for the times of steps.
struct Ran {
    int step = 0, view = 0, region = 0, thread = 0;
    double begin = 0, end = 0;  // seconds since the run began
};

class Arenas;

struct RunOptions {
    int threads = 1;
    Arenas* arenas = nullptr;        // where threads wait between runs; null: this run's own
    MemoryBudget* memory = nullptr;  // required
    const std::atomic<bool>* stop = nullptr;  // set by whoever wants it to end
    /// Share of all nodes that are done, 0..1, and the step that just ended.
    std::function<void(double share, const std::string& step)> progress = {};
    bool records = true;  // seconds, names and nodes of steps in the outcome
    /// Asked after a step failed: a plan for the rest without that edge, from the given whole
    /// representations (sources), or none. @param failed the edge, as `--without` takes it
    std::function<std::optional<Plan>(const std::string& failed, const std::string& why,
                                      const std::vector<Representation>& held)>
        replan = {};
    /// Tests break a node here: called before each; what it throws is that node's failure.
    std::function<void(int step, int view, int region)> before_node = {};
};

struct Outcome {
    double seconds = 0;
    std::size_t peak = 0;           // bytes of the budget used at most
    std::vector<Message> warnings;  // a failed step, and what was done instead
    // Where the options ask for records:
    std::vector<double> step_seconds;  // wall time of the plan's steps: wall_seconds(trace)
    std::vector<Ran> trace;
    std::vector<std::string> steps;  // that really ran
};

/// Called once a frame, in no particular order, never two at a time. Whoever keeps the result keeps
/// its bytes: they must be pinned in the plan. What it throws is a failure that no other plan
/// mends.
using Deliver = std::function<void(int frame, std::shared_ptr<const Data> result)>;

/// Runs a plan in lanes: the set-up is one, every frame is one. A Program (runtime/program.hpp) is
/// for plans that run more than once.
/// @throws Cancelled where stopped; the first failure where no other plan exists
Outcome run(const Plan& plan, const Ask& ask, std::shared_ptr<const Data> source,
            const Deliver& deliver, const RunOptions& options);

/// Wall time of each step. One run of a step lasts from the begin of its first node to the end of
/// its last, however many threads its regions share. Where runs overlap (frames side by side), each
/// gets an equal share of the time that they have in common: so the steps of one frame last as long
/// as a clock beside them shows, and all steps together never longer than the whole run.
/// @param trace  of one plan
/// @param steps  of that plan; those that never ran take 0
std::vector<double> wall_seconds(const std::vector<Ran>& trace, std::size_t steps);

/// What run() would do, as DOT: a rectangle for each entry of its trace, an ellipse for the data
/// between them. Steps that run box by box (Plan::boxes) are a chain for each box; arcs in it say
/// how large the box between them is, and an ellipse joins the boxes.
std::string flow_dot(const Plan& plan, const Ask& ask);
/// Trace in Chrome's JSON array format.
std::string chrome_trace(const Plan& plan, const std::vector<Ran>& trace);

}  // namespace edgewise
