#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <memory_resource>
#include <optional>
#include <string>
#include <vector>

#include "graph/plan.hpp"

namespace edgewise {

/// A memory resource that counts and refuses: all samples and scratch of a run come from one.
/// Large blocks are mapped and kept for reuse while the limit allows, since the first touch of a
/// page costs more than a trilinear pass reads.
class MemoryBudget : public std::pmr::memory_resource {
 public:
    explicit MemoryBudget(std::size_t limit);
    ~MemoryBudget() override;
    std::size_t used() const noexcept;
    std::size_t peak() const noexcept;
    std::size_t limit() const noexcept;
    /// Gives back what is kept for reuse.
    void trim() noexcept;

 private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override;
    void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override;
    bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
        return this == &other;
    }
    struct State;
    std::unique_ptr<State> state_;
};

/// One node that ran: for traces and for the times of steps.
struct Ran {
    int step = 0, view = 0, region = 0, thread = 0;
    double begin = 0, end = 0;  // seconds since the run began
};

struct RunOptions {
    int threads = 1;
    MemoryBudget* memory = nullptr;           // required
    const std::atomic<bool>* stop = nullptr;  // set by whoever wants it to end
    /// Share of all nodes that are done, 0..1, and the step that just ended.
    std::function<void(double share, const std::string& step)> progress;
    /// Asked after a step failed: a plan for the rest without that edge, from the given whole
    /// representations (sources), or none. @param failed the edge, as `--without` takes it
    std::function<std::optional<Plan>(const std::string& failed, const std::string& why,
                                      const std::vector<Representation>& held)>
        replan;
    /// Tests break a node here: called before each; what it throws is that node's failure.
    std::function<void(int step, int view, int region)> before_node;
};

struct Outcome {
    double seconds = 0;
    std::vector<double> step_seconds;  // of the plan's steps, all runs
    std::size_t peak = 0;              // bytes of the budget used at most
    std::vector<Ran> trace;
    std::vector<std::string> warnings;  // a failed step, and what was done instead
    std::vector<std::string> steps;     // that really ran
};

/// Called once a frame, never two at a time; the data is gone afterwards.
using Deliver = std::function<void(int frame, const Data& result)>;

/// Runs a plan as a flow graph in lanes: the set-up is one, every frame is one.
/// @throws Cancelled where stopped; the first failure where no other plan exists
Outcome run(const Plan& plan, const Ask& ask, std::shared_ptr<const Data> source,
            const Deliver& deliver, const RunOptions& options);

/// The nodes and arcs that run() would make, as DOT.
std::string flow_dot(const Plan& plan, const Ask& ask);
/// Trace in Chrome's JSON array format.
std::string chrome_trace(const Plan& plan, const std::vector<Ran>& trace);

}  // namespace edgewise
