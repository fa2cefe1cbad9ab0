#include "engine/planned.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <malloc.h>

#include "engine/ask_planner.hpp"
#include "engine/pilot.hpp"
#include "engine/shown.hpp"
#include "graph/errors.hpp"
#include "measure/machine.hpp"
#include "measure/since.hpp"
#include "planner/cost.hpp"
#include "reference/verify.hpp"

namespace edgewise {
namespace {

using Clock = std::chrono::steady_clock;

/// What a run takes of its reserve as a rule: the code of kernels, and what threads touch of their
/// stacks.
constexpr double kGrowth = 1 << 20, kGrowthAThread = 1 << 18;

/// What a file's type changes is the same whatever path is taken. Where it is no part of the
/// budget, as of a filter that is to be equal but for rounding, paths are compared without it.
void leave_writing_out(Planned& planned) {
    if (planned.want.budget.error_yields) planned.want.written.reset();
}

/// What is promised and measured of the path that was chosen is of the file all the same.
void count_writing(Planned& planned) {
    Request& want = planned.want;
    if (!want.budget.error_yields || !planned.outputs || planned.input.described) return;
    const Statistics& statistics = planned.statistics;
    take_written(planned, statistics.low, statistics.high);
    if (!want.written || planned.drawn == 0) return;
    const double error = rounding_of(planned.ask()) / planned.scene.range;
    const auto copies = [&](const Step& step) {
        return step.by->error_of(step.offer, planned.ask()).copies;
    };
    const auto raise = [&](Plan& plan) {
        // An integer type is that of the samples; f32 may have fewer digits.
        if (want.written->rounds() && std::all_of(plan.steps.begin(), plan.steps.end(), copies))
            return;
        plan.predicted.error = std::hypot(plan.predicted.error, error);
        if (!plan.steps.empty()) plan.steps.back().predicted.error = plan.predicted.error;
    };
    if (planned.answer.plan) raise(*planned.answer.plan);
    for (std::vector<Plan>* plans : {&planned.answer.front, &planned.answer.nearest})
        for (Plan& plan : *plans) raise(plan);
}

double frame_bytes(const Request& want) {
    const Extent out = want.output();
    return double(out.x) * double(out.y) * double(out.z) *
           (want.job == Job::render ? want.mode->channels : 1) * sizeof(float);
}

/// Bytes that stay whatever the path: samples, results that wait, and their last form.
double pinned_bytes(const Planned& planned) {
    const Request& want = planned.want;
    const int channels = want.job->samples ? planned.input.channels() : 1;
    const double frame = frame_bytes(want) * channels;
    const double written = frame / sizeof(float) * double(bytes_of(planned.written.tail.type));
    // Ranks read what they work on, and keep their share of the results.
    if (want.ranks > 1)
        return planned.writes_at_once() ? 0 : frame * (want.frames - 1) / want.ranks;
    const double samples = planned.input.bytes();
    // The planner counts one result; the others wait in memory as well.
    double pinned = samples + shown_bytes(planned);
    if (!planned.writes_at_once()) pinned += frame * (want.frames - 1);
    // A single result is finished after the samples are given back, pictures on the way before.
    const bool on_the_way = planned.as.refinement && planned.as.refinement->writes();
    const bool beside = want.frames > 1 || on_the_way || planned.as.keeps_samples;
    pinned += beside ? written : std::max(0.0, written - samples);
    return pinned;
}

/// What verifying needs in addition to samples and results, when the path has ended.
double verifying_bytes(const Planned& planned) {
    if (!planned.query.verify || !planned.input.data->samples.data()) return 0;
    const ReferenceField field(*planned.input.data, planned.want.field,
                               planned.input.phantom ? &*planned.input.phantom : nullptr);
    return verifier_bytes(planned.want, field, static_cast<std::int64_t>(*planned.query.verify),
                          planned.want.threads);
}

/// The answer of a pilot. @throws RequestError where there are no samples
Answer piloted(const Planned& planned, Listener& messages) {
    if (!planned.input.data->samples.data())
        throw RequestError(
            message("@planner: without samples nothing can be measured; only estimate"));
    const Answer& answer = planned.answer;
    // As long as a few dozen runs take, within reason.
    constexpr double kRuns = 40, kLeast = 2.5, kMost = 20;
    const double guess = answer.plan ? answer.plan->predicted.seconds : kMost / kRuns;
    const std::optional<double> given = planned.query.planning_time;
    const double limit = given.value_or(std::clamp(kRuns * guess, kLeast, kMost));
    try {
        return measured_answer(planned, messages, planned.query.planner == Planner::exhaustive,
                               limit, given.value_or(kMost));
    } catch (const std::bad_alloc&) {
        messages.warning(message("@planner: no memory left to measure with; models decide"));
        return answer;
    }
}

/// Why an edge that was asked for cannot serve, or "".
Message refused_demand(const Planned& planned) {
    for (const Demand& demand : planned.query.demands.via)
        for (const Refusal& refusal : planned.answer.refused)
            if (demand.name == refusal.transition ||
                refusal.transition.starts_with(demand.name + "."))
                return message("{}: {}", refusal.transition, refusal.reason);
    return {};
}

/// That rounding to the file's type is what breaks an error budget, or "".
Message rounding_text(const Planned& planned) {
    const Request& want = planned.want;
    if (!want.written || !want.budget.error || !planned.query.max_error) return {};
    const double error = rounding_of(planned.ask()) / planned.scene.range;
    if (error <= *want.budget.error) return {};
    return message(
        "; rounding to {} alone makes an error of {:.3g}: {}", name_of(want.written->type), error,
        want.written->rounds()
            ? message("write f32 (@bits(32) and a format that holds it, as .nrrd or .tif)")
            : message("write all digits (no @bits, and a format that holds the type)"));
}

/// Labels that nobody called so: a plan that computes between them makes new ones.
void hint_at_labels(const Planned& planned, Listener& messages) {
    const Request& want = planned.want;
    const Input& input = planned.input;
    if (want.job != Job::warp || want.field != Field::spline || planned.query.reference ||
        input.phantom || !input.data->samples.data())
        return;
    const auto copies = [&](const Step& step) {
        return step.by->error_of(step.offer, planned.ask()).copies;
    };
    const std::vector<Step>& steps = planned.answer.plan->steps;
    if (std::all_of(steps.begin(), steps.end(), copies)) return;
    if (looks_like_labels(*input.data, planned.scene.commonest))
        messages.warning(
            message("{} may hold labels (few different values): values between them appear; "
                    "@labels makes none",
                    input.name));
}

/// What the planner says, with an error budget as it was typed.
std::string problem_text(const Planned& planned) {
    std::string text = planned.answer.problem;
    const std::optional<double>& limit = planned.want.budget.error;
    const std::string& typed = planned.query.notation.error;
    if (!limit || typed.empty()) return text;
    const std::string number = fmt::format("an error of {:.3g}", *limit);
    if (const std::size_t at = text.find(number); at != text.npos)
        text.replace(at, number.size(), "an error of " + error_words(*limit, typed));
    return text;
}

std::string nearest_text(const Planned& planned) {
    std::string text;
    for (const Plan& plan : planned.answer.nearest)
        text += fmt::format("\n  {}: {:.3g} s, {:.0f} MiB, error {}", fmt::join(plan.texts(), ", "),
                            plan.predicted.seconds, plan.predicted.bytes / 0x1p20,
                            plan.predicted.known
                                ? error_words(plan.predicted.error, planned.query.notation.error)
                                : "unknown");
    return text.empty() ? text : "; the nearest are" + text;
}

/// An answer by these steps alone, without budgets; without a plan where one of them refuses.
Answer answer_by(const Planned& planned, const std::vector<Demand>& via) {
    Request want = planned.want;
    want.budget.error.reset();
    want.budget.seconds.reset();
    want.budget.like.reset();
    PlanOptions options = planned.plan_options;
    options.front = false;
    options.demands = {.via = via, .without = {}};
    return plan(planned.engine.edges(), {want, planned.scene}, planned.sources(),
                planned.engine.machine(), options);
}

/// All paths of the answer's graph that no other beats.
void add_front(Planned& planned) {
    planned.answer.front = plan(planned.answer.graph, planned.engine.edges(), planned.ask(),
                                planned.engine.machine(), planned.plan_options)
                               .front;
}

}  // namespace

std::shared_ptr<const PricedGraph> Planned::graph() const {
    if (answer.graph) return answer.graph;
    return std::make_shared<PricedGraph>(engine.edges(), ask(), sources(), engine.machine(),
                                         plan_options);
}

std::optional<double> Planned::saved_seconds() const {
    if (!answer.plan || !answer.plain || !answer.plain->seconds) return std::nullopt;
    return query.repeat * (*answer.plain->seconds - answer.plan->predicted.seconds);
}

void take_bytes(Planned& planned) {
    leave_writing_out(planned);
    planned.plan_options.demands = planned.query.demands;
    planned.plan_options.pinned = pinned_bytes(planned);
    planned.plan_options.resident = planned.resident;
    if (planned.want.ranks > 1) return;
    planned.plan_options.after = std::max(verifying_bytes(planned), showing_bytes(planned));
    // What reading and measuring have left behind counts once, as samples or as `held`.
    planned.memory->trim();
    if (planned.as.guest) {
        planned.plan_options.held = kGrowth + kGrowthAThread * planned.want.threads;
        return;
    }
    malloc_trim(0);
    planned.plan_options.held = std::max(0.0, resident_now() - double(planned.memory->used())) +
                                kGrowth + kGrowthAThread * planned.want.threads;
}

void forget_errors(Planned& planned) {
    if (planned.errors == ErrorsWanted::asked) return;
    Answer& answer = planned.answer;
    const auto forget = [](Plan& plan) {
        plan.predicted.known = false;
        for (Step& step : plan.steps) step.predicted.known = false;
    };
    if (answer.plan) forget(*answer.plan);
    for (std::vector<Plan>* plans : {&answer.front, &answer.nearest})
        for (Plan& plan : *plans) forget(plan);
}

Planned unplanned(Looked looked, const Effort& effort) {
    Planned planned(std::move(looked));
    planned.errors = errors_of(planned, effort);
    planned.plan_options.front = effort.front;
    planned.plan_options.random_costs = effort.random_costs;
    take_bytes(planned);
    return planned;
}

Planned price(Looked looked, const Effort& effort, Listener& messages) {
    if (messages.stop()) throw Cancelled();
    const auto begin = Clock::now();
    Planned planned = unplanned(std::move(looked), effort);
    planned.spent.search += since(begin);
    planned.plan_options.front = false;
    {
        const InState unobserved(messages, Listener::State::unobserved);
        planned = ask_planner(std::move(planned));
    }
    // It is only shown: what it takes is no part of choosing.
    planned.plan_options.front = effort.front;
    if (effort.front && planned.answer.graph) add_front(planned);
    if (planned.query.planner != Planner::estimate) {
        const auto begun = Clock::now();
        planned.answer = piloted(planned, messages);
        planned.spent.pilot += since(begun);
    }
    count_writing(planned);
    planned.answer.seconds = planned.spent.all();
    messages.ends(Listener::State::planning);
    for (const Message& warning : planned.answer.warnings) messages.warning(warning);
    if (planned.answer.plan)
        hint_at_labels(planned, messages);
    else
        planned.way_out = way_out_of(planned);
    return planned;
}

Planned follow(Looked looked, const Plan& path, Listener& messages) {
    constexpr Effort kNone{.errors = ErrorsWanted::never, .front = false};
    Planned planned = unplanned(std::move(looked), kNone);
    std::vector<Demand> all, computing;
    for (const Step& step : path.steps) {
        all.push_back({step.by->name, step.offer.with});
        if (!step.by->error_of(step.offer, planned.ask()).copies) computing.push_back(all.back());
    }
    for (const std::vector<Demand>& via : {all, computing}) {
        planned.answer = answer_by(planned, via);
        if (!planned.answer.plan) continue;
        planned.answer.plan->predicted.known = false;
        return planned;
    }
    const std::vector<Refusal> refused = planned.answer.refused;
    if (planned.drawn == 0) look_at_data(planned, 1);
    Planned other = price(std::move(planned), {.front = false}, messages);
    expect_plan(other);
    for (const Demand& step : computing)
        for (const Refusal& refusal : refused)
            if (refusal.transition == step.name)
                messages.warning(message("{} refuses here ({}): this goes by {}", step.name,
                                         refusal.reason,
                                         fmt::join(other.answer.plan->texts(), ", ")));
    return other;
}

void expect_plan(const Planned& planned) {
    if (planned.answer.plan) return;
    const Message refused = refused_demand(planned);
    throw Infeasible(
        message("{}{}{}{}", refused.empty() ? Message(problem_text(planned)) : refused,
                rounding_text(planned), nearest_text(planned), text_of(*planned.way_out)),
        *planned.way_out);
}

}  // namespace edgewise
