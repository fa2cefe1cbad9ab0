#include "engine/prepared.hpp"

#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

#include "engine/reached.hpp"
#include "graph/errors.hpp"
#include "runtime/program.hpp"

namespace edgewise {
namespace {

/// The steps at the begin of a plan that serve all views: what they make hangs on the samples and
/// not on how they are seen.
std::size_t steps_of_input(const Plan& plan) {
    std::size_t steps = 0;
    // Boxes of results in between are never whole.
    if (plan.boxes > 1) return 0;
    while (steps + 1 < plan.steps.size() && plan.steps[steps].runs() == 1 &&
           plan.steps[steps].offer.to.space != "screen")
        ++steps;
    return steps;
}

/// A part of a plan.
Plan part_of(const Plan& plan, std::size_t begin, std::size_t end) {
    Plan part = plan;
    part.steps.assign(plan.steps.begin() + static_cast<std::ptrdiff_t>(begin),
                      plan.steps.begin() + static_cast<std::ptrdiff_t>(end));
    if (begin > 0) part.source = plan.steps[begin - 1].offer.to;
    return part;
}

/// What plans share their memory by: with the last of them goes what was kept for their next runs,
/// and not only with the last result.
struct TrimsAtEnd {
    std::shared_ptr<MemoryBudget> memory;

    void operator()(MemoryBudget* budget) const noexcept { budget->trim(); }
};

/// A result that outlives the plan, with the memory that its bytes go back to.
std::shared_ptr<const Data> kept(std::shared_ptr<const Data> made,
                                 std::shared_ptr<MemoryBudget> memory) {
    struct Held {
        std::shared_ptr<MemoryBudget> memory;  // goes after what gives bytes back to it
        std::shared_ptr<const Data> data;
    };
    if (const auto* of_plans = std::get_deleter<TrimsAtEnd>(memory)) memory = of_plans->memory;
    const auto held = std::make_shared<const Held>(Held{std::move(memory), std::move(made)});
    return {held, held->data.get()};
}

/// What a plan's edges read: of a caller's samples the last rows once more. A plan without a step
/// gives the samples back as they are.
std::shared_ptr<const Data> as_read(const std::shared_ptr<const Data>& samples, const Plan& plan,
                                    MemoryBudget& memory) {
    if (plan.steps.empty() || samples->samples.bytes() == 0 || samples->samples.has_slack())
        return samples;
    return std::make_shared<const Data>(with_slack(*samples, &memory));
}

}  // namespace

/// What the runs of one plan share.
struct Prepared::Shared {
    std::size_t steps = 0;  // of the plan, whose result it is
    Program rest;           // of the plan
    std::size_t bytes = 0;  // of a frame
    std::shared_ptr<const std::vector<std::string>> texts;
    std::mutex mutex;
    std::shared_ptr<const Data> made;  // what the rest reads; null: not yet

    explicit Shared(const Planned& planned)
        : steps(steps_of_input(*planned.answer.plan)),
          rest(part_of(*planned.answer.plan, steps, planned.answer.plan->steps.size()),
               planned.ask()),
          texts(std::make_shared<const std::vector<std::string>>(planned.answer.plan->texts())) {}
};

Prepared::Prepared(Planned planned) : Prepared(std::move(planned), {}) {}

Prepared::Prepared(Planned planned, std::vector<Message> warnings)
    : planned_(std::make_shared<const Planned>(std::move(planned))),
      warnings_(std::move(warnings)) {
    expect_plan(*planned_);
    shared_ = std::make_shared<Shared>(*planned_);
    shared_->bytes = static_cast<std::size_t>(result().bytes());
}

Representation Prepared::result() const {
    return plan().steps.empty() ? planned_->stored : plan().steps.back().offer.to;
}

Prepared::Result Prepared::run(const RunWith& with) const {
    const Planned& planned = *planned_;
    const std::size_t each = shared_->bytes;
    if (!with.into.empty() && with.into.size() != each * static_cast<std::size_t>(frames()))
        throw RequestError(fmt::format("run: {} bytes are given for {} frames of {} bytes",
                                       with.into.size(), frames(), each));
    RunOptions options;
    options.threads = with.threads > 0 ? with.threads : planned.want.threads;
    options.arenas = &planned.engine.arenas();
    options.memory = planned.memory.get();
    options.stop = with.stop;
    options.records = false;
    if (with.on_progress) options.progress = std::cref(with.on_progress);
    const std::shared_ptr<const Data> source = shared_input(options);
    Result result;
    if (with.keep_frames) result.frames.resize(static_cast<std::size_t>(frames()));
    const auto take = [&](int frame, std::shared_ptr<const Data> made) {
        const auto at = static_cast<std::size_t>(frame);
        if (!with.into.empty())
            std::memcpy(with.into.data() + each * at, made->samples.data(), each);
        if (with.on_frame) with.on_frame({frame, *made});
        if (with.keep_frames) result.frames[at] = kept(std::move(made), planned.memory);
    };
    const Deliver deliver = std::cref(take);  // a reference, for which a function allocates nothing
    Outcome outcome = shared_->rest.run(source, deliver, options);
    for (const auto& frame : result.frames)
        if (frame->samples.has_slack() && frame->samples.data() != source->samples.data())
            planned.memory->give_away(frame->samples.data(), frame->samples.bytes() + kArraySlack);
    result.steps = shared_->texts;
    result.warnings = std::move(outcome.warnings);
    result.seconds = outcome.seconds;
    return result;
}

std::shared_ptr<const Data> Prepared::shared_input(const RunOptions& options) const {
    const std::lock_guard lock(shared_->mutex);
    if (shared_->made) return shared_->made;
    std::shared_ptr<const Data> samples = as_read(planned_->input.data, plan(), *planned_->memory);
    if (shared_->steps > 0) {
        Request once = planned_->want;
        once.frames = 1;
        const Plan first = part_of(plan(), 0, shared_->steps);
        const std::shared_ptr<const Data> all = std::move(samples);
        const Deliver take = [&](int, std::shared_ptr<const Data> made) {
            samples = std::move(made);
        };
        edgewise::run(first, {once, planned_->scene}, all, take, options);
    }
    shared_->made = std::move(samples);
    return shared_->made;
}

Prepared Prepared::with_input(std::shared_ptr<const Data> samples) const {
    const Planned& planned = *planned_;
    if (!samples || samples->what.text() != planned.stored.text())
        throw RequestError(fmt::format("with_input: the samples are {}, and the plan is for {}",
                                       samples ? samples->what.text() : "none",
                                       planned.stored.text()));
    Opened opened = planned;
    opened.as.given = samples;
    opened.as.loaded.reset();
    Input input = planned.input;
    input.data = std::move(samples);
    input.identity.reset();  // nobody knows what it is
    Listener messages;
    const InSeries same{.first = &planned};
    Looked looked = look(opened, std::move(input), {.errors = ErrorsWanted::never}, messages, same);
    Planned followed = follow(std::move(looked), plan(), messages);
    return Prepared(std::move(followed), messages.warnings());
}

Prepared Prepared::with_views(const GeometrySpec& views) const {
    const Planned& planned = *planned_;
    Query query = planned.query;
    query.geometry = views;
    Opening as = planned.as;
    as.described = std::make_shared<const Input>(planned.input);
    Listener messages;
    Opened opened = open(ask(planned.engine, std::move(query), as), messages);
    opened.memory = planned.memory;
    opened.resident = planned.resident;
    const InSeries same{.first = &planned};
    Looked looked = look(opened, planned.input, {.errors = ErrorsWanted::never}, messages, same);
    Planned followed = follow(std::move(looked), plan(), messages);
    return Prepared(std::move(followed), messages.warnings());
}

Prepared prepare(const Engine& engine, Query query, Opening as, const Effort& effort,
                 Listener& messages) {
    as.runs = as.keeps_samples = as.guest = true;
    Reached reached(ask(engine, std::move(query), std::move(as)));
    reached.prepare(effort, messages);
    Planned planned = std::move(reached.plan());
    MemoryBudget* const memory = planned.memory.get();
    planned.memory = {memory, TrimsAtEnd{std::move(planned.memory)}};
    return Prepared(std::move(planned));
}

Prepared prepare(const Engine& engine, Query query, std::shared_ptr<const Data> given,
                 const Effort& effort) {
    Listener messages;
    return prepare(engine, std::move(query), Opening{.given = std::move(given)}, effort, messages);
}

}  // namespace edgewise
