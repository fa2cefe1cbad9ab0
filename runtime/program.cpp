#include "runtime/program.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <mutex>
#include <optional>
#include <set>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <utility>

#include "runtime/flow.hpp"
#include "runtime/flush_denormals.hpp"
#include "runtime/kept_arena.hpp"

namespace edgewise {

/// What all runs share, and the runs that wait to be used again.
struct Program::State {
    Course course;
    std::mutex mutex;
    std::vector<std::unique_ptr<Flow>> waiting;

    State(Plan plan, const Ask& ask, std::vector<int> frames)
        : course(std::move(plan), ask, std::move(frames)) {}

    std::unique_ptr<Flow> take() {
        {
            const std::lock_guard lock(mutex);
            if (!waiting.empty()) {
                std::unique_ptr<Flow> flow = std::move(waiting.back());
                waiting.pop_back();
                return flow;
            }
        }
        return std::make_unique<Flow>(course);
    }

    void give_back(std::unique_ptr<Flow> flow) noexcept {
        if (!flow->clear()) return;
        const std::lock_guard lock(mutex);
        try {
            waiting.push_back(std::move(flow));
        } catch (const std::bad_alloc&) {
            // It goes, and the next run makes another.
        }
    }

    /// A run for as long as it lives.
    class Lent {
     public:
        explicit Lent(State& state) : state_(state), flow_(state.take()) {}
        ~Lent() { state_.give_back(std::move(flow_)); }
        Lent(const Lent&) = delete;
        Lent& operator=(const Lent&) = delete;
        Flow* operator->() noexcept { return flow_.get(); }
        const Flow& operator*() const noexcept { return *flow_; }

     private:
        State& state_;
        std::unique_ptr<Flow> flow_;
    };
};

namespace {

std::vector<int> all_frames(int count) {
    std::vector<int> frames(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) frames[static_cast<std::size_t>(i)] = i;
    return frames;
}

/// oneTBB starts as many threads as there are cores, if it is not told otherwise.
std::optional<tbb::global_control> more_than_cores(int threads) {
    static const int cores = tbb::info::default_concurrency();
    constexpr auto kMost = tbb::global_control::max_allowed_parallelism;
    if (threads <= cores) return {};
    return std::optional<tbb::global_control>(
        std::in_place, kMost,
        std::max<std::size_t>(static_cast<std::size_t>(threads),
                              tbb::global_control::active_value(kMost)));
}

/// What is left after a failure: frames to make, a plan without the failed edge, and its source.
struct Rest {
    std::vector<int> frames;
    std::optional<Plan> plan;
    std::shared_ptr<const Data> source;
};

Rest replan(const Flow& flow, const Course& course, const RunOptions& options) {
    Rest rest;
    const std::set<int> done(flow.delivered().begin(), flow.delivered().end());
    for (const int frame : course.frames)
        if (!done.contains(frame)) rest.frames.push_back(frame);
    const Flow::Failure& failure = *flow.failure();
    if (failure.step < 0 || !options.replan) return rest;
    const auto held = flow.held();
    std::vector<Representation> whole;
    for (const auto& data : held) whole.push_back(data->what);
    rest.plan = options.replan(course.plan.steps[failure.step].text(), failure.why(), whole);
    for (const auto& data : held)
        if (rest.plan && data->what.key() == rest.plan->source.key()) rest.source = data;
    return rest;
}

void record(Outcome& outcome, const Flow& flow, const Plan& plan) {
    outcome.step_seconds = wall_seconds(flow.trace(), plan.steps.size());
    outcome.trace.insert(outcome.trace.end(), flow.trace().begin(), flow.trace().end());
    outcome.steps = plan.texts();
}

}  // namespace

Program::Program(Plan plan, const Ask& ask)
    : Program(std::move(plan), ask, all_frames(ask.want.frames)) {}

Program::Program(Plan plan, const Ask& ask, std::vector<int> frames)
    : state_(std::make_unique<State>(std::move(plan), ask, std::move(frames))) {}

Program::~Program() = default;
Program::Program(Program&&) noexcept = default;
Program& Program::operator=(Program&&) noexcept = default;

const Plan& Program::plan() const noexcept { return state_->course.plan; }

Outcome Program::run(std::shared_ptr<const Data> source, const Deliver& deliver,
                     const RunOptions& options) const {
    const double start = seconds_now();
    const int threads = std::max(1, options.threads);
    const auto allowed = more_than_cores(threads);
    const FlushDenormals flushed;
    std::optional<Arenas> own;
    KeptArena arena(options.arenas ? *options.arenas : own.emplace(), threads);
    Outcome outcome;
    std::optional<Program> other;  // after a step failed
    const Program* program = this;
    // A caller may have them back: where no step runs they are the result.
    if (!plan().steps.empty() && source->samples.bytes() > 0 && !source->samples.has_slack() &&
        source->tail.bytes() == 0)
        source = std::make_shared<const Data>(with_slack(*source, options.memory));
    for (;;) {
        const Course& course = program->state_->course;
        Rest rest;
        {
            State::Lent flow(*program->state_);
            arena.execute([&] { flow->run(source, deliver, options, start); });
            if (options.records) record(outcome, *flow, course.plan);
            if (options.stop && options.stop->load()) throw Cancelled();
            if (!flow->failure()) break;
            const Flow::Failure failure = *flow->failure();
            rest = replan(*flow, course, options);
            if (!rest.plan || !rest.source) std::rethrow_exception(failure.cause);
            outcome.warnings.push_back(fmt::format(
                "{} failed ({}); went on with {}", course.plan.steps[failure.step].text(),
                failure.why(), fmt::join(rest.plan->texts(), ", ")));
        }
        source = std::move(rest.source);
        const Ask ask = course.ask;  // the course may be that of `other`
        other.emplace(std::move(*rest.plan), ask, std::move(rest.frames));
        program = &*other;
    }
    outcome.seconds = seconds_now() - start;
    outcome.peak = options.memory->peak();
    return outcome;
}

Outcome run(const Plan& plan, const Ask& ask, std::shared_ptr<const Data> source,
            const Deliver& deliver, const RunOptions& options) {
    return Program(plan, ask).run(std::move(source), deliver, options);
}

}  // namespace edgewise
