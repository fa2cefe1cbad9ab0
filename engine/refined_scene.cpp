#include "engine/refined_scene.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "engine/known_scene.hpp"
#include "engine/planned.hpp"
#include "planner/alike.hpp"
#include "planner/choice.hpp"
#include "scene/preview.hpp"
#include "scene/scene.hpp"

namespace edgewise {
namespace {

constexpr double kWorth = 0.9;  // of what is minimised
constexpr double kMost = 2;     // [s] that drawing more may take, whatever it saves
Answer answer_to(const Planned& planned, const Scene& scene) {
    return plan(planned.engine.edges(), {planned.want, scene}, planned.sources(),
                planned.engine.machine(), planned.plan_options);
}

/// Whether no path is faster by so much, whatever its error. Then more draws can gain nothing.
bool is_fastest(const Answer& answer, Minimize minimize) {
    if (minimize != Minimize::time || !answer.plan) return false;
    return answer.front.empty() ||
           answer.front.front().predicted.seconds >= kWorth * answer.plan->predicted.seconds;
}

/// How long drawing may take [s] for what the plan by likely errors would save; 0: nothing to gain.
/// @param runs  that are asked for
double worth(const std::optional<Plan>& sure, const std::optional<Plan>& likely, Minimize minimize,
             int runs) {
    if (!likely || !sure) return 0;
    const Predicted &has = sure->predicted, &could = likely->predicted;
    if (minimize == Minimize::memory) return could.bytes < kWorth * has.bytes ? kMost : 0;
    if (minimize == Minimize::error || could.seconds >= kWorth * has.seconds) return 0;
    return std::min(kMost, runs * (has.seconds - could.seconds));
}

Scene drawn_more(Planned& planned, int times) {
    const auto begin = std::chrono::steady_clock::now();
    Scene scene = known_scene(planned.engine.edges(), planned.input, planned.statistics,
                              planned.want, planned.memory.get(), times,
                              untried(planned.query.demands, planned.engine.edges()));
    planned.spent.preview +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return scene;
}

/// What a preview of the usual draws is expected to take [s]. It is counted and not timed, so that
/// a request gives the same plan under any load.
double preview_seconds(const Planned& planned) {
    const Work work{.operations = preview_operations(planned.want)};
    return planned.engine.machine().counted(work).seconds / planned.engine.machine().processors;
}

/// Chooses without a preview where that could not pay. Either the fastest path that is not barred
/// is as good as asked for, whatever a preview would show: its errors are those of the plain path,
/// say, or none. Or it would save less than the preview costs. @return false where a preview must
/// decide
bool chooses_unseen(Planned& planned) {
    const Request& want = planned.want;
    if (!want.budget.like) {  // no budget of any error
        planned.answer = answer_to(planned, planned.scene);
        return true;
    }
    Request open = want;
    open.budget.like->times = std::numeric_limits<double>::infinity();
    const std::vector<Source> sources = planned.sources();
    const auto answer_by = [&](const PlanOptions& options) {
        return plan(planned.engine.edges(), {open, planned.scene}, sources,
                    planned.engine.machine(), options);
    };
    Answer answer = answer_by(planned.plan_options);
    if (!answer.plan) return false;
    const auto is_sure = [&](const Plan& plan) {
        return plan.predicted.likeness == Likeness::alike &&
               feasible(plan.predicted, open.budget) &&
               alike_unseen(plan, planned.engine.edges(), planned.ask(), sources,
                            *want.budget.like);
    };
    if (!is_sure(*answer.plan)) {
        if (want.minimize != Minimize::time) return false;
        std::optional<Plan> sure;
        PlanOptions all = planned.plan_options;
        all.front = true;
        for (const Plan& plan : answer_by(all).front)  // fastest first
            if (!sure && is_sure(plan)) sure = plan;
        if (!sure && answer.plain && planned.query.demands.via.empty()) {
            PlanOptions by_plain = planned.plan_options;
            by_plain.demands.via = {demand_of(answer.plain->step, planned.engine.edges())};
            const Answer plain = answer_by(by_plain);
            if (plain.plan && is_sure(*plain.plan)) sure = plain.plan;
        }
        if (!sure) return false;
        const double saved = sure->predicted.seconds - answer.plan->predicted.seconds;
        if (planned.query.repeat * saved > preview_seconds(planned)) return false;
        answer.plan = std::move(sure);
    }
    answer.plain.reset();  // its error is a guess
    planned.answer = std::move(answer);
    return true;
}

/// That a result is equal but for rounding is nobody's demand, and nothing is looked at for its
/// sake. Where errors were measured all the same, to be shown, the same path is taken.
void choose_unseen(Planned& planned) {
    Scene unseen = planned.scene;
    std::erase_if(unseen.facts, [](const auto& fact) { return is_of_results(fact.first); });
    unseen.range = unseen_scene(planned.statistics).range;
    Answer chosen = answer_to(planned, unseen);
    if (!chosen.plan) return;
    PlanOptions options = planned.plan_options;
    options.demands.via.clear();
    for (const Step& step : chosen.plan->steps)
        options.demands.via.push_back({step.by->name, step.offer.with});
    Answer measured = plan(planned.engine.edges(), planned.ask(), planned.sources(),
                           planned.engine.machine(), options);
    if (!measured.plan) return;
    planned.answer.plan = std::move(measured.plan);
    planned.answer.warnings = std::move(chosen.warnings);
}

}  // namespace

void ask_planner(Planned& planned) {
    const Request& want = planned.want;
    const auto begin = std::chrono::steady_clock::now();
    const double looked = planned.spent.preview;
    const auto searched = [&] {
        const double all =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        planned.spent.search += all - (planned.spent.preview - looked);
    };
    if (planned.errors == ErrorsWanted::for_choice && planned.drawn == 0) {
        if (chooses_unseen(planned)) return searched();
        look_at_data(planned, true);
        take_bytes(planned);
    }
    const double usual = preview_seconds(planned);
    planned.answer = answer_to(planned, planned.scene);
    if (want.budget.error_yields && planned.drawn > 0) choose_unseen(planned);
    // A likeness compares likely errors with each other: they are of the same draws.
    const bool refines = want.budget.error && planned.query.planner == Planner::estimate;
    for (const int times : {4, 16}) {
        if (!refines || planned.scene.draws == 0 || planned.scene.exhausted ||
            is_fastest(planned.answer, want.minimize))
            break;
        const Answer likely = answer_to(planned, planned.scene.as_likely());
        if (worth(planned.answer.plan, likely.plan, want.minimize, planned.query.repeat) <
            times * usual)
            break;
        Scene before = std::exchange(planned.scene, drawn_more(planned, times));
        take_bytes(planned);
        Answer answer = answer_to(planned, planned.scene);
        if (!answer.plan) {  // there was one, or nothing would have been worth the draws
            planned.scene = std::move(before);
            take_bytes(planned);
            break;
        }
        planned.drawn = times;
        planned.answer = std::move(answer);
    }
    searched();
}

}  // namespace edgewise
