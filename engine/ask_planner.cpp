#include "engine/ask_planner.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <utility>

#include "engine/measure/since.hpp"
#include "engine/planned.hpp"
#include "planner/alike.hpp"
#include "planner/choice.hpp"
#include "scene/preview.hpp"
#include "scene/scene.hpp"

namespace edgewise {
namespace {

constexpr double kWorth = 0.9;  // of what is minimised
constexpr double kMost = 2;     // [s] that drawing more may take, whatever it saves
/// So many times the usual draws.
constexpr std::array kDraws = {1, 4, 16};

Answer answer_by(const Planned& planned, const Request& want, const Scene& scene,
                 const PlanOptions& options) {
    return plan(planned.engine.edges(), {want, scene}, planned.sources(), planned.engine.machine(),
                options);
}

/// What a preview of the usual draws is expected to take [s]. It is counted and not timed, so that
/// a request gives the same plan under any load.
double preview_seconds(const Planned& planned) {
    const Profile& machine = planned.engine.machine();
    const Work work{.operations = preview_operations(planned.want)};
    return machine.counted(work).seconds / machine.processors;
}

/// Whether a plan is as good as asked for, whatever a preview would show: its errors are those of
/// the plain path, say, or none.
bool is_sure(const Plan& plan, const Planned& planned) {
    const Budget& budget = planned.want.budget;
    return plan.predicted.likeness == Likeness::alike && feasible(plan.predicted, budget) &&
           alike_unseen(plan, planned.engine.edges(), planned.ask(), planned.sources(),
                        *budget.like);
}

/// The fastest plan that is surely as good as asked for.
/// @param want,answer  as choice_without_preview() has them
std::optional<Plan> fastest_sure(const Planned& planned, const Request& want,
                                 const Answer& answer) {
    PlanOptions options = planned.plan_options;
    options.front = true;
    for (Plan& plan : answer_by(planned, want, planned.scene, options).front)  // fastest first
        if (is_sure(plan, planned)) return std::move(plan);
    if (!answer.plain || !planned.query.demands.via.empty()) return std::nullopt;
    options.front = planned.plan_options.front;
    options.demands.via = {demand_of(answer.plain->step, planned.engine.edges())};
    Answer plain = answer_by(planned, want, planned.scene, options);
    if (!plain.plan || !is_sure(*plain.plan, planned)) return std::nullopt;
    return std::move(plain.plan);
}

/// An answer by costs and guesses alone; nothing where a preview has to decide. It has not to where
/// the fastest path is surely as good as asked for, or would save less over the runs than the
/// preview costs.
std::optional<Answer> choice_without_preview(const Planned& planned) {
    Request want = planned.want;
    // No budget of any error.
    if (!want.budget.like) return answer_by(planned, want, planned.scene, planned.plan_options);
    want.budget.like->times = std::numeric_limits<double>::infinity();
    Answer answer = answer_by(planned, want, planned.scene, planned.plan_options);
    if (!answer.plan) return std::nullopt;
    if (!is_sure(*answer.plan, planned)) {
        if (want.minimize != Minimize::time) return std::nullopt;
        std::optional<Plan> sure = fastest_sure(planned, want, answer);
        if (!sure) return std::nullopt;
        const double saved = sure->predicted.seconds - answer.plan->predicted.seconds;
        if (planned.query.repeat * saved > preview_seconds(planned)) return std::nullopt;
        answer.plan = std::move(sure);
    }
    answer.plain.reset();  // its error is a guess
    return answer;
}

/// That a result is equal but for rounding is nobody's demand, and nothing is looked at for its
/// sake. Where errors were measured all the same, to be shown, the path is that of who did not
/// look; its predictions are of what was measured.
void take_path_of_guesses(const Planned& planned, Answer& answer) {
    Scene unseen = planned.scene;
    std::erase_if(unseen.facts, [](const auto& fact) {
        return fact.first.starts_with("run/") || fact.first.starts_with("result/") ||
               fact.first == "written";
    });
    unseen.range = unseen_scene(planned.statistics).range;
    Answer chosen = answer_by(planned, planned.want, unseen, planned.plan_options);
    if (!chosen.plan) return;
    PlanOptions options = planned.plan_options;
    options.demands.via.clear();
    for (const Step& step : chosen.plan->steps)
        options.demands.via.push_back({step.by->name, step.offer.with});
    Answer measured = answer_by(planned, planned.want, planned.scene, options);
    if (!measured.plan) return;
    answer.plan = std::move(measured.plan);
    answer.warnings = std::move(chosen.warnings);
}

/// The answer by what is known so far; nothing where that is too little.
std::optional<Answer> chosen(const Planned& planned) {
    if (planned.drawn == 0 && planned.errors == ErrorsWanted::for_choice)
        return choice_without_preview(planned);
    Answer answer = answer_by(planned, planned.want, planned.scene, planned.plan_options);
    if (planned.want.budget.error_yields && planned.drawn > 0)
        take_path_of_guesses(planned, answer);
    return answer;
}

/// Whether no path is faster by so much, whatever its error. Then more draws can gain nothing.
bool is_fastest(const Answer& answer, Minimize minimize) {
    if (minimize != Minimize::time || !answer.plan) return false;
    return answer.front.empty() ||
           answer.front.front().predicted.seconds >= kWorth * answer.plan->predicted.seconds;
}

/// How long drawing may take [s] for what the plan by likely errors would save; 0: nothing to gain.
double worth(const Planned& planned, const std::optional<Plan>& likely) {
    const std::optional<Plan>& sure = planned.answer.plan;
    if (!likely || !sure) return 0;
    const Predicted &has = sure->predicted, &could = likely->predicted;
    const Minimize minimize = planned.want.minimize;
    if (minimize == Minimize::memory) return could.bytes < kWorth * has.bytes ? kMost : 0;
    if (minimize == Minimize::error || could.seconds >= kWorth * has.seconds) return 0;
    return std::min(kMost, planned.query.repeat * (has.seconds - could.seconds));
}

/// How many times the usual draws are to be made next; 0: the answer stays.
int next_draws(const Planned& planned, bool is_chosen) {
    if (!is_chosen) return kDraws.front();
    // A likeness compares likely errors with each other: they are of the same draws.
    const bool refines = planned.want.budget.error && planned.query.planner == Planner::estimate;
    if (!refines || planned.scene.draws == 0 || planned.scene.exhausted ||
        planned.drawn == kDraws.back() || is_fastest(planned.answer, planned.want.minimize))
        return 0;
    const int times = *std::upper_bound(kDraws.begin(), kDraws.end(), planned.drawn);
    const Answer likely =
        answer_by(planned, planned.want, planned.scene.as_likely(), planned.plan_options);
    return worth(planned, likely.plan) < times * preview_seconds(planned) ? 0 : times;
}

/// The same with a preview, and no answer yet.
Planned drawn(Planned planned, int times) {
    planned.answer = {};
    look_at_data(planned, times);
    take_bytes(planned);
    return planned;
}

}  // namespace

Planned ask_planner(Planned planned) {
    const auto begin = std::chrono::steady_clock::now();
    const double looked = planned.spent.preview;
    std::optional<Answer> answer = chosen(planned);
    if (answer) planned.answer = *std::move(answer);
    for (bool is_chosen = answer.has_value(); const int times = next_draws(planned, is_chosen);) {
        Planned next = drawn(planned, times);
        next.answer = chosen(next).value();
        planned.spent = next.spent;
        // There was a plan, or nothing would have been worth the draws.
        if (is_chosen && !next.answer.plan) {
            take_bytes(planned);
            break;
        }
        planned = std::move(next);
        is_chosen = true;
    }
    planned.spent.search += since(begin) - (planned.spent.preview - looked);
    return planned;
}

}  // namespace edgewise
