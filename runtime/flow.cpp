#include <algorithm>
#include <chrono>
#include <deque>
#include <fmt/format.h>
#include <mutex>
#include <optional>
#include <set>
#include <tbb/flow_graph.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "runtime/flush_denormals.hpp"
#include "runtime/kept_arena.hpp"
#include "runtime/runtime.hpp"
#include "runtime/schedule.hpp"

namespace edgewise {
namespace {

namespace flow = tbb::flow;
using Node = flow::continue_node<flow::continue_msg>;

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

/// Why a run ended early: the first failure counts, later ones follow from it.
struct Failure {
    int step = -1;  // -1: not a step's fault (delivery)
    std::string why;
    std::exception_ptr cause;
};

/// What one task made: parts until they are merged, then the whole.
struct Product {
    std::vector<Data> parts;  // Partition::input with several regions
    std::shared_ptr<Data> data;
    bool whole = false;
    int readers = 0;
    double reserved = 0;  // given back when the product goes
};

/// One plan running as a flow graph. No body throws into the graph: an exception would leave it
/// indeterminate, and lanes that still wait would hang.
class Flow {
 public:
    Flow(const Plan& plan, const Ask& ask, std::shared_ptr<const Data> source,
         const Deliver& deliver, const RunOptions& options, Schedule what, double start)
        : plan_(plan),
          ask_(ask),
          source_(std::move(source)),
          deliver_(deliver),
          options_(options),
          schedule_(std::move(what)),
          start_(start),
          products_(schedule_.tasks.size()),
          left_(schedule_.lanes.size()) {
        for (const Task& task : schedule_.tasks) {
            nodes_total_ += task.regions.size();
            ++left_[task.lane];
        }
        for (std::size_t i = 0; i < products_.size(); ++i)
            products_[i].readers = schedule_.tasks[i].readers;
    }

    void run() {
        for (const int frame : schedule_.ready) guarded(-1, [&] { hand_over(frame, source_); });
        if (schedule_.lanes.empty()) return;
        build();
        admit();
        graph_.wait_for_all();
    }

    const std::optional<Failure>& failure() const { return failure_; }
    const std::vector<int>& delivered() const { return delivered_; }

    /// Whole results that serve every view: where a new plan may start.
    std::vector<std::shared_ptr<const Data>> held() const {
        std::vector<std::shared_ptr<const Data>> all{source_};
        for (std::size_t i = 0; i < products_.size(); ++i)
            if (products_[i].whole && products_[i].data && products_[i].data->what.runs() == 1)
                all.push_back(products_[i].data);
        return all;
    }

    std::vector<Ran> trace;

 private:
    /// Each task is a begin node (allocates), one node a region, and an end node (merges, frees).
    void build() {
        for (std::size_t lane = 0; lane < schedule_.lanes.size(); ++lane)
            gates_.emplace_back(graph_);
        std::vector<Node*> ends(schedule_.tasks.size());
        for (std::size_t i = 0; i < schedule_.tasks.size(); ++i) {
            const Task& task = schedule_.tasks[i];
            const int at = static_cast<int>(i);
            Node& begin = add([this, at] { begin_task(at); });
            Node& end = add([this, at] { end_task(at); });
            flow::make_edge(gates_[task.lane], begin);
            if (task.input >= 0) flow::make_edge(*ends[task.input], begin);
            for (std::size_t r = 0; r < task.regions.size(); ++r) {
                Node& region = add([this, at, r] { run_region(at, static_cast<int>(r)); });
                flow::make_edge(begin, region);
                flow::make_edge(region, end);
            }
            ends[i] = &end;
        }
    }

    template <class Body>
    Node& add(Body body) {
        return nodes_.emplace_back(graph_, [body](const flow::continue_msg&) {
            body();
            return flow::continue_msg();
        });
    }

    /// Lets lanes in, in order, as long as their bytes fit; one always may, so none waits for ever.
    /// A lane reserves all before its first node and gives it back as a whole: no lane waits while
    /// it holds, hence no deadlock.
    void admit() {
        std::vector<std::size_t> let_in;
        {
            const std::lock_guard lock(mutex_);
            while (next_lane_ < schedule_.lanes.size() && !halted()) {
                const double wanted = schedule_.lanes[next_lane_].bytes;
                const double free =
                    static_cast<double>(options_.memory->limit()) - in_use_before_ - reserved_;
                if (running_ > 0 && (wanted > free || running_ >= options_.threads)) break;
                reserved_ += wanted;
                ++running_;
                let_in.push_back(next_lane_++);
            }
        }
        for (const std::size_t lane : let_in) gates_[lane].try_put(flow::continue_msg());
    }

    bool halted() const {
        return failed_.load(std::memory_order_relaxed) ||
               (options_.stop && options_.stop->load(std::memory_order_relaxed));
    }

    template <class Body>
    void guarded(int step, Body body) {
        if (halted()) return;
        try {
            // Isolated: while it waits for its own tiles, a thread must not pick up another node,
            // whose scratch would come on top of this one's, or which would ask for a lock that
            // this one holds.
            tbb::this_task_arena::isolate(body);
        } catch (const Cancelled& cancelled) {
            // It noticed the flag that another node, or the user, has set.
            if (!halted()) fail(step, cancelled.what());
        } catch (const std::bad_alloc&) {
            fail(step, "out of memory within the budget");
        } catch (const Exception& error) {
            fail(step, error.message().marked());
        } catch (const std::exception& error) {
            fail(step, error.what());
        } catch (...) {
            fail(step, "an exception of unknown type");
        }
    }

    void fail(int step, std::string why) {
        const std::lock_guard lock(mutex_);
        if (!failure_) failure_ = Failure{step, std::move(why), std::current_exception()};
        failed_.store(true, std::memory_order_relaxed);
    }

    const Data& input_of(const Task& task) const {
        return task.input < 0 ? *source_ : *products_[task.input].data;
    }

    bool in_parts(const Task& task) const {
        const Step& step = plan_.steps[task.step];
        return task.regions.size() > 1 && step.by->parts(step.offer, ask_).kind == Partition::input;
    }

    void begin_task(int at) {
        const Task& task = schedule_.tasks[at];
        guarded(task.step, [&] {
            Product& product = products_[at];
            const Representation& what = plan_.steps[task.step].offer.to;
            product.data = std::make_shared<Data>(plan_.steps[task.step].by->attaches
                                                      ? Data::sharing(input_of(task), what)
                                                      : Data::make(what, options_.memory));
            for (std::size_t r = 1; in_parts(task) && r < task.regions.size(); ++r)
                product.parts.push_back(Data::make(what, options_.memory));
        });
    }

    void run_region(int at, int r) {
        const Task& task = schedule_.tasks[at];
        guarded(task.step, [&] {
            if (options_.before_node) options_.before_node(task.step, task.view, r);
            Product& product = products_[at];
            Data& out = r > 0 && in_parts(task) ? product.parts[r - 1] : *product.data;
            if (task.first == task.step)
                return run_step(task, task.step, r, input_of(task), out, task.regions[r]);
            const std::vector<Region> boxes =
                boxes_read(plan_, ask_, task.first, task.regions[r], task.view);
            Data before;
            for (int step = task.first; step <= task.step; ++step) {
                const Data& in = step == task.first ? input_of(task) : before;
                const Region& box = boxes[step - task.first];
                if (step == task.step) return run_step(task, step, r, in, out, box);
                Data made = Data::make(plan_.steps[step].offer.to, box, options_.memory);
                run_step(task, step, r, in, made, box);
                before = std::move(made);
            }
        });
    }

    void run_step(const Task& task, int at, int r, const Data& in, Data& out,
                  const Region& region) {
        const Step& step = plan_.steps[at];
        Context context{options_.memory, options_.stop, &failed_, task.view};
        Ran ran{at, task.view, r, 0, now() - start_, 0};
        step.by->run(step.offer, ask_, in, out, region, context);
        for (const std::string& facet : step.offer.to.facets)
            if (!out.facets.contains(facet))
                throw RunError(step.text() + " left out its facet " + facet);
        context.poll();  // a step that returned early has not done its work
        ran.end = now() - start_;
        ran.thread = tbb::this_task_arena::current_thread_index();
        note(ran, step, at == task.step);
    }

    void note(const Ran& ran, const Step& step, bool ends) {
        const std::lock_guard lock(mutex_);
        trace.push_back(ran);
        if (ends) ++nodes_done_;
        if (options_.progress)
            options_.progress(static_cast<double>(nodes_done_) / nodes_total_, step.by->name);
    }

    void end_task(int at) {
        const Task& task = schedule_.tasks[at];
        Product& product = products_[at];
        guarded(task.step, [&] { merge(task, product); });
        if (!halted()) product.whole = true;
        // After a failure what is whole stays: another plan may start with it.
        if (task.input >= 0 && !halted()) release(task.input);
        for (const int frame : task.frames) guarded(-1, [&] { hand_over(frame, product.data); });
        if (product.readers == 0) product.data.reset();
        leave_lane(task.lane);
    }

    /// Joins parts pairwise in one fixed tree: (0 1) (2 3) ..., so that the order of rounding never
    /// hangs on who finished first.
    void merge(const Task& task, Product& product) {
        if (product.parts.empty()) return;
        const Step& step = plan_.steps[task.step];
        const auto join = step.by->parts(step.offer, ask_).merge;
        std::vector<Data*> parts{product.data.get()};
        for (Data& part : product.parts) parts.push_back(&part);
        for (std::size_t width = 1; width < parts.size(); width *= 2)
            for (std::size_t i = 0; i + width < parts.size(); i += 2 * width)
                join(*parts[i], *parts[i + width]);
        product.parts.clear();
    }

    void hand_over(int frame, std::shared_ptr<const Data> result) {
        const std::lock_guard lock(deliver_mutex_);
        deliver_(frame, std::move(result));
        delivered_.push_back(frame);
    }

    void release(int at) {
        std::shared_ptr<Data> last;
        const std::lock_guard lock(mutex_);
        Product& product = products_[at];
        if (--product.readers > 0) return;
        last.swap(product.data);
        reserved_ -= product.reserved;
    }

    void leave_lane(std::size_t lane) {
        {
            const std::lock_guard lock(mutex_);
            if (--left_[lane] > 0) return;
            --running_;
            reserved_ -= schedule_.lanes[lane].bytes;
            for (const int at : schedule_.lanes[lane].tasks) {
                if (!products_[at].data) continue;  // else other lanes still read it
                products_[at].reserved = held_bytes(plan_.steps[schedule_.tasks[at].step].offer.to);
                reserved_ += products_[at].reserved;
            }
        }
        admit();
    }

    const Plan& plan_;
    const Ask& ask_;
    std::shared_ptr<const Data> source_;
    const Deliver& deliver_;
    const RunOptions& options_;
    const Schedule schedule_;
    const double start_;

    flow::graph graph_;
    std::deque<flow::broadcast_node<flow::continue_msg>> gates_;
    std::deque<Node> nodes_;
    std::vector<Product> products_;
    std::vector<int> left_;  // tasks of a lane that are not done
    std::vector<int> delivered_;
    std::mutex mutex_, deliver_mutex_;
    std::optional<Failure> failure_;
    std::atomic<bool> failed_ = false;
    std::size_t next_lane_ = 0, nodes_total_ = 0, nodes_done_ = 0;
    int running_ = 0;
    double reserved_ = 0;
    const double in_use_before_ = static_cast<double>(options_.memory->used());
};

std::vector<int> all_frames(int count) {
    std::vector<int> frames(count);
    for (int i = 0; i < count; ++i) frames[i] = i;
    return frames;
}

/// What is left after a failure: frames to make, a plan without the failed edge, and its source.
struct Rest {
    std::vector<int> frames;
    std::optional<Plan> plan;
    std::shared_ptr<const Data> source;
};

Rest replan(const Flow& flow, const Plan& plan, const RunOptions& options,
            const std::vector<int>& wanted) {
    Rest rest;
    const std::set<int> done(flow.delivered().begin(), flow.delivered().end());
    for (const int frame : wanted)
        if (!done.contains(frame)) rest.frames.push_back(frame);
    const Failure& failure = *flow.failure();
    if (failure.step < 0 || !options.replan) return rest;
    const auto held = flow.held();
    std::vector<Representation> whole;
    for (const auto& data : held) whole.push_back(data->what);
    rest.plan = options.replan(plan.steps[failure.step].text(), failure.why, whole);
    for (const auto& data : held)
        if (rest.plan && data->what.key() == rest.plan->source.key()) rest.source = data;
    return rest;
}

}  // namespace

Outcome run(const Plan& first, const Ask& ask, std::shared_ptr<const Data> source,
            const Deliver& deliver, const RunOptions& options) {
    const double start = now();
    const int threads = std::max(1, options.threads);
    const tbb::global_control allowed(
        tbb::global_control::max_allowed_parallelism,
        std::max<std::size_t>(threads, tbb::global_control::active_value(
                                           tbb::global_control::max_allowed_parallelism)));
    const FlushDenormals flushed;
    KeptArena arena(threads);
    Outcome outcome;
    Plan plan = first;
    std::vector<int> frames = all_frames(ask.want.frames);
    // A caller may have them back: where no step runs they are the result.
    if (!plan.steps.empty() && source->samples.bytes() > 0 && !source->samples.has_slack())
        source = std::make_shared<const Data>(with_slack(*source, options.memory));
    for (;;) {
        std::optional<Flow> flow;
        arena.execute([&] {
            flow.emplace(plan, ask, source, deliver, options, schedule(plan, ask, frames), start);
            flow->run();
        });
        outcome.step_seconds = wall_seconds(flow->trace, plan.steps.size());
        outcome.trace.insert(outcome.trace.end(), flow->trace.begin(), flow->trace.end());
        outcome.steps = plan.texts();
        if (options.stop && options.stop->load()) throw Cancelled();
        if (!flow->failure()) break;
        const Failure failure = *flow->failure();
        Rest rest = replan(*flow, plan, options, frames);
        if (!rest.plan || !rest.source) std::rethrow_exception(failure.cause);
        outcome.warnings.push_back(fmt::format("{} failed ({}); went on with {}",
                                               plan.steps[failure.step].text(), failure.why,
                                               fmt::join(rest.plan->texts(), ", ")));
        plan = std::move(*rest.plan);
        frames = std::move(rest.frames);
        source = std::move(rest.source);
        arena.execute([&] { flow.reset(); });
    }
    outcome.seconds = now() - start;
    outcome.peak = options.memory->peak();
    return outcome;
}

}  // namespace edgewise
