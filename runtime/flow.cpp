#include "runtime/flow.hpp"

#include <chrono>
#include <deque>
#include <memory_resource>
#include <tbb/flow_graph.h>
#include <tbb/task_arena.h>
#include <utility>

#include "graph/small_objects.hpp"
#include "runtime/seen_order.hpp"

namespace edgewise {
namespace {

namespace flow = tbb::flow;
using Node = flow::continue_node<flow::continue_msg>;

/// Data whose small parts are used again.
std::shared_ptr<Data> pooled(Data data) {
    return std::allocate_shared<Data>(std::pmr::polymorphic_allocator<Data>(small_objects()),
                                      std::move(data));
}

}  // namespace

double seconds_now() noexcept {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

Course::Course(Plan of, const Ask& asked, std::vector<int> wanted)
    : plan(std::move(of)),
      ask(asked),
      frames(std::move(wanted)),
      schedule(edgewise::schedule(plan, ask, frames)) {
    for (const Step& step : plan.steps) parts.push_back(step.by->parts(step.offer, ask));
    for (const Task& task : schedule.tasks) nodes += task.regions.size();
}

/// The nodes of all lanes. They stay as they are from run to run.
struct Flow::Graph {
    flow::graph graph;
    std::deque<flow::broadcast_node<flow::continue_msg>> gates;
    std::deque<Node> nodes;
    SeenOrder order;

    /// Each task is a begin node (allocates), one node a region, and an end node (merges, frees).
    explicit Graph(Flow& of) {
        const Schedule& what = of.schedule_;
        for (std::size_t lane = 0; lane < what.lanes.size(); ++lane) gates.emplace_back(graph);
        std::vector<Node*> ends(what.tasks.size());
        for (std::size_t i = 0; i < what.tasks.size(); ++i) {
            const Task& task = what.tasks[i];
            const int at = static_cast<int>(i);
            Node& begin = add([&of, at] { of.begin_task(at); });
            Node& end = add([&of, at] { of.end_task(at); });
            flow::make_edge(gates[task.lane], begin);
            if (task.input >= 0) flow::make_edge(*ends[task.input], begin);
            for (std::size_t r = 0; r < task.regions.size(); ++r) {
                Node& region = add([&of, at, r] { of.run_region(at, static_cast<int>(r)); });
                flow::make_edge(begin, region);
                flow::make_edge(region, end);
            }
            ends[i] = &end;
        }
    }

    template <class Body>
    Node& add(Body body) {
        return nodes.emplace_back(graph, [this, body](const flow::continue_msg&) {
            order.begins();
            body();
            order.ends();
            return flow::continue_msg();
        });
    }
};

Flow::Flow(const Course& course)
    : course_(course),
      plan_(course.plan),
      schedule_(course.schedule),
      products_(schedule_.tasks.size()),
      left_(schedule_.lanes.size()) {
    delivered_.reserve(course.frames.size());
}

Flow::~Flow() {
    graph_.reset();  // waits for nodes that are still at work, which need all else
}

void Flow::run(const std::shared_ptr<const Data>& source, const Deliver& deliver,
               const RunOptions& options, double start) {
    source_ = source;
    deliver_ = &deliver;
    options_ = &options;
    start_ = start;
    begin();
    for (const int frame : schedule_.ready) guarded(-1, [&] { hand_over(frame, source_); });
    if (schedule_.lanes.empty()) return;
    if (options.threads <= 1 || course_.nodes == 1)
        run_in_order();
    else
        run_as_graph();
}

/// Everything as before the first node.
void Flow::begin() {
    failure_.reset();
    failed_ = false;
    delivered_.clear();
    trace_.clear();
    next_lane_ = nodes_done_ = 0;
    running_ = 0;
    reserved_ = 0;
    in_use_before_ = static_cast<double>(options_->memory->used());
    for (std::size_t lane = 0; lane < left_.size(); ++lane)
        left_[lane] = static_cast<int>(schedule_.lanes[lane].tasks.size());
    for (std::size_t i = 0; i < products_.size(); ++i) {
        products_[i].readers = schedule_.tasks[i].readers;
        products_[i].reserved = 0;
        products_[i].whole = false;
    }
}

bool Flow::clear() noexcept {
    if (!ended_) return false;
    for (Product& product : products_) {
        product.parts.clear();
        product.data.reset();
    }
    source_.reset();
    failure_.reset();
    return true;
}

std::vector<std::shared_ptr<const Data>> Flow::held() const {
    std::vector<std::shared_ptr<const Data>> all{source_};
    for (const Product& product : products_)
        if (product.whole && product.data && product.data->what.runs() == 1)
            all.push_back(product.data);
    return all;
}

/// A lane after the other, as the flow graph would on one thread.
void Flow::run_in_order() {
    for (const Lane& lane : schedule_.lanes)
        for (const int at : lane.tasks) {
            if (halted()) return;
            begin_task(at);
            const auto regions = static_cast<int>(schedule_.tasks[at].regions.size());
            for (int r = 0; r < regions; ++r) run_region(at, r);
            end_task(at);
        }
}

void Flow::run_as_graph() {
    if (!graph_)
        graph_ = std::make_unique<Graph>(*this);
    else
        graph_->graph.reset();  // it goes to this thread's arena, and forgets a run that was halted
    ended_ = false;
    graph_->order.ends();
    admit();
    graph_->graph.wait_for_all();
    graph_->order.begins();
    ended_ = true;
}

/// Lets lanes in, in order, as long as their bytes fit; one always may, so none waits for ever.
/// A lane reserves all before its first node and gives it back as a whole: no lane waits while
/// it holds, hence no deadlock.
void Flow::admit() {
    while (const std::optional<std::size_t> lane = next_admitted())
        graph_->gates[*lane].try_put(flow::continue_msg());
}

std::optional<std::size_t> Flow::next_admitted() {
    const std::lock_guard lock(mutex_);
    if (next_lane_ == schedule_.lanes.size() || halted()) return {};
    const double wanted = schedule_.lanes[next_lane_].bytes;
    const double free = static_cast<double>(options_->memory->limit()) - in_use_before_ - reserved_;
    if (running_ > 0 && (wanted > free || running_ >= options_->threads)) return {};
    reserved_ += wanted;
    ++running_;
    return next_lane_++;
}

bool Flow::halted() const noexcept {
    return failed_.load(std::memory_order_relaxed) ||
           (options_->stop && options_->stop->load(std::memory_order_relaxed));
}

template <class Body>
void Flow::guarded(int step, Body body) {
    if (halted()) return;
    try {
        // Isolated: while it waits for its own tiles, a thread must not pick up another node,
        // whose scratch would come on top of this one's, or which would ask for a lock that
        // this one holds.
        tbb::this_task_arena::isolate(body);
    } catch (const Cancelled&) {
        // It noticed the flag that another node, or the user, has set.
        if (!halted()) fail(step);
    } catch (...) {
        fail(step);
    }
}

/// Within a handler. Allocates nothing: there may be no memory.
void Flow::fail(int step) noexcept {
    const std::lock_guard lock(mutex_);
    if (!failure_) failure_ = Failure{step, std::current_exception()};
    failed_.store(true, std::memory_order_relaxed);
}

std::string Flow::Failure::why() const {
    try {
        std::rethrow_exception(cause);
    } catch (const std::bad_alloc&) {
        return "out of memory within the budget";
    } catch (const Exception& error) {
        return error.message().marked();
    } catch (const std::exception& error) {
        return error.what();
    } catch (...) {
        return "an exception of unknown type";
    }
}

const Data& Flow::input_of(const Task& task) const noexcept {
    return task.input < 0 ? *source_ : *products_[task.input].data;
}

bool Flow::in_parts(const Task& task) const noexcept {
    return task.regions.size() > 1 &&
           course_.parts[static_cast<std::size_t>(task.step)].kind == Partition::input;
}

void Flow::begin_task(int at) {
    const Task& task = schedule_.tasks[at];
    guarded(task.step, [&] {
        Product& product = products_[at];
        const Representation& what = plan_.steps[task.step].offer.to;
        product.data =
            pooled(plan_.steps[task.step].by->attaches ? Data::sharing(input_of(task), what)
                                                       : Data::make(what, options_->memory));
        for (std::size_t r = 1; in_parts(task) && r < task.regions.size(); ++r)
            product.parts.push_back(Data::make(what, options_->memory));
    });
}

void Flow::run_region(int at, int r) {
    const Task& task = schedule_.tasks[at];
    guarded(task.step, [&] {
        if (options_->before_node) options_->before_node(task.step, task.view, r);
        Product& product = products_[at];
        Data& out = r > 0 && in_parts(task) ? product.parts[r - 1] : *product.data;
        if (task.first == task.step)
            return run_step(task, task.step, r, input_of(task), out, task.regions[r]);
        const std::vector<Region>& boxes = task.boxes[static_cast<std::size_t>(r)];
        std::optional<Data> before;
        for (int step = task.first; step <= task.step; ++step) {
            const Data& in = step == task.first ? input_of(task) : *before;
            const Region& box = boxes[step - task.first];
            if (step == task.step) return run_step(task, step, r, in, out, box);
            Data made = Data::make(plan_.steps[step].offer.to, box, options_->memory);
            run_step(task, step, r, in, made, box);
            before.emplace(std::move(made));
        }
    });
}

void Flow::run_step(const Task& task, int at, int r, const Data& in, Data& out,
                    const Region& region) {
    const Step& step = plan_.steps[at];
    Context context{options_->memory, options_->stop, &failed_, task.view};
    Ran ran{at, task.view, r, 0, seconds_now() - start_, 0};
    step.by->run(step.offer, course_.ask, in, out, region, context);
    for (const std::string& facet : step.offer.to.facets)
        if (!out.facets.contains(facet))
            throw RunError(step.text() + " left out its facet " + facet);
    context.poll();  // a step that returned early has not done its work
    ran.end = seconds_now() - start_;
    ran.thread = tbb::this_task_arena::current_thread_index();
    note(ran, step, at == task.step);
}

void Flow::note(const Ran& ran, const Step& step, bool ends) {
    const std::lock_guard lock(mutex_);
    if (options_->records) trace_.push_back(ran);
    if (ends) ++nodes_done_;
    if (options_->progress)
        options_->progress(static_cast<double>(nodes_done_) / static_cast<double>(course_.nodes),
                           step.by->name);
}

void Flow::end_task(int at) {
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
void Flow::merge(const Task& task, Product& product) {
    if (product.parts.empty()) return;
    const auto& join = course_.parts[static_cast<std::size_t>(task.step)].merge;
    std::vector<Data*>& parts = product.joined;
    parts.assign(1, product.data.get());
    for (Data& part : product.parts) parts.push_back(&part);
    for (std::size_t width = 1; width < parts.size(); width *= 2)
        for (std::size_t i = 0; i + width < parts.size(); i += 2 * width)
            join(*parts[i], *parts[i + width]);
    product.parts.clear();
}

void Flow::hand_over(int frame, std::shared_ptr<const Data> result) {
    const std::lock_guard lock(deliver_mutex_);
    (*deliver_)(frame, std::move(result));
    delivered_.push_back(frame);
}

void Flow::release(int at) {
    std::shared_ptr<Data> last;
    const std::lock_guard lock(mutex_);
    Product& product = products_[at];
    if (--product.readers > 0) return;
    last.swap(product.data);
    reserved_ -= product.reserved;
}

void Flow::leave_lane(std::size_t lane) {
    if (ended_) return;  // lanes follow one another
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

}  // namespace edgewise
