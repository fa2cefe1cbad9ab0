#pragma once

#include <memory>
#include <vector>

#include "runtime/runtime.hpp"

namespace edgewise {

/// A plan that can run: what its runs do is worked out once. It never changes, and threads share
/// it. Each run takes what it changes (counters, nodes of a flow graph) from those that ended
/// before it, so that the second of several equal runs makes nothing anew: what samples and scratch
/// take comes from the run's memory, and goes back to it.
class Program {
 public:
    /// @param ask  what it refers to outlives the program
    Program(Plan plan, const Ask& ask);
    /// Makes these frames only.
    Program(Plan plan, const Ask& ask, std::vector<int> frames);
    ~Program();
    Program(Program&&) noexcept;
    Program& operator=(Program&&) noexcept;

    const Plan& plan() const noexcept;
    /// From any number of threads at once. A plan with several lanes or regions runs as a flow
    /// graph; on one thread, and where there is one node, nodes are called one after the other.
    /// @throws Cancelled where stopped; the first failure where no other plan exists
    Outcome run(std::shared_ptr<const Data> source, const Deliver& deliver,
                const RunOptions& options) const;

 private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace edgewise
