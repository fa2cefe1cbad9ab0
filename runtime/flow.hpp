#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "runtime/runtime.hpp"
#include "runtime/schedule.hpp"

namespace edgewise {

/// Seconds of a clock that never goes back.
double seconds_now() noexcept;

/// What all runs of a plan share.
struct Course {
    Plan plan;
    Ask ask;  // what it refers to outlives the course
    std::vector<int> frames;
    Schedule schedule;
    std::vector<Partition> parts;  // of the plan's steps
    std::size_t nodes = 0;         // runs of steps on regions

    Course(Plan of, const Ask& asked, std::vector<int> wanted);
};

/// One run of a plan, with all that changes in it; run after run, but one at a time. No node throws
/// into the flow graph: an exception would leave it indeterminate, and lanes that still wait would
/// hang.
class Flow {
 public:
    /// @param course  outlives it
    explicit Flow(const Course& course);
    ~Flow();
    Flow(const Flow&) = delete;
    Flow& operator=(const Flow&) = delete;

    /// In the calling thread's arena. What it refers to lives until clear().
    /// @param start  from where the trace counts seconds
    void run(const std::shared_ptr<const Data>& source, const Deliver& deliver,
             const RunOptions& options, double start);
    /// Gives back all data. @return whether it may run again
    bool clear() noexcept;

    /// Why a run ended early: the first failure counts, later ones follow from it.
    struct Failure {
        int step = -1;  // -1: not a step's fault (delivery)
        std::exception_ptr cause;

        std::string why() const;
    };
    const std::optional<Failure>& failure() const noexcept { return failure_; }
    const std::vector<int>& delivered() const noexcept { return delivered_; }
    /// Whole results that serve every view: where a new plan may start.
    std::vector<std::shared_ptr<const Data>> held() const;
    /// Where the options ask for one.
    const std::vector<Ran>& trace() const noexcept { return trace_; }

 private:
    /// What one task made: parts until they are merged, then the whole.
    struct Product {
        std::vector<Data> parts;  // Partition::input with several regions
        std::vector<Data*> joined;
        std::shared_ptr<Data> data;
        bool whole = false;
        int readers = 0;
        double reserved = 0;  // given back when the product goes
    };
    struct Graph;

    void begin();
    void run_in_order();
    void run_as_graph();
    void admit();
    std::optional<std::size_t> next_admitted();
    bool halted() const noexcept;
    template <class Body>
    void guarded(int step, Body body);
    void fail(int step) noexcept;

    const Data& input_of(const Task& task) const noexcept;
    bool in_parts(const Task& task) const noexcept;
    void begin_task(int at);
    void run_region(int at, int r);
    void run_step(const Task& task, int at, int r, const Data& in, Data& out, const Region& region);
    void note(const Ran& ran, const Step& step, bool ends);
    void end_task(int at);
    void merge(const Task& task, Product& product);
    void hand_over(int frame, std::shared_ptr<const Data> result);
    void release(int at);
    void leave_lane(std::size_t lane);

    const Course& course_;
    const Plan& plan_;
    const Schedule& schedule_;

    // Of this run.
    std::shared_ptr<const Data> source_;
    const Deliver* deliver_ = nullptr;
    const RunOptions* options_ = nullptr;
    double start_ = 0;
    bool ended_ = true;  // no node of it is at work

    std::unique_ptr<Graph> graph_;  // null: none of its runs needed one so far
    std::vector<Product> products_;
    std::vector<int> left_;  // tasks of a lane that are not done
    std::vector<int> delivered_;
    std::vector<Ran> trace_;
    std::mutex mutex_, deliver_mutex_;
    std::optional<Failure> failure_;
    std::atomic<bool> failed_ = false;
    std::size_t next_lane_ = 0, nodes_done_ = 0;
    int running_ = 0;
    double reserved_ = 0, in_use_before_ = 0;
};

}  // namespace edgewise
