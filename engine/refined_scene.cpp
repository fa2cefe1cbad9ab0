#include "engine/refined_scene.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "engine/known_scene.hpp"
#include "engine/session.hpp"
#include "planner/alike.hpp"
#include "planner/choice.hpp"
#include "scene/preview.hpp"
#include "scene/scene.hpp"

namespace edgewise {
namespace {

constexpr double kWorth = 0.9;  // of what is minimised
constexpr double kMost = 2;     // [s] that drawing more may take, whatever it saves
Answer answer_to(const Session& session, const Scene& scene) {
    return plan(session.edges, {session.want(), scene}, session.sources(), session.profile,
                session.plan_options);
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

Scene drawn_more(Session& session, int times) {
    const auto begin = std::chrono::steady_clock::now();
    Scene scene =
        known_scene(session.edges, *session.input, session.statistics, session.want(),
                    session.memory.get(), times, untried(session.spec.demands, session.edges));
    session.spent.preview +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return scene;
}

/// What a preview of the usual draws is expected to take [s]. It is counted and not timed, so that
/// a request gives the same plan under any load.
double preview_seconds(const Session& session) {
    const Work work{.operations = preview_operations(session.want())};
    return session.profile.counted(work).seconds / session.profile.processors;
}

/// Chooses without a preview where that could not pay. Either the fastest path that is not barred
/// is as good as asked for, whatever a preview would show: its errors are those of the plain path,
/// say, or none. Or it would save less than the preview costs. @return false where a preview must
/// decide
bool chooses_unseen(Session& session) {
    const Request& want = session.want();
    if (!want.budget.like) {  // no budget of any error
        session.answer = answer_to(session, session.scene);
        return true;
    }
    Request open = want;
    open.budget.like->times = std::numeric_limits<double>::infinity();
    const std::vector<Source> sources = session.sources();
    const auto answer_by = [&](const PlanOptions& options) {
        return plan(session.edges, {open, session.scene}, sources, session.profile, options);
    };
    Answer answer = answer_by(session.plan_options);
    if (!answer.plan) return false;
    const auto is_sure = [&](const Plan& plan) {
        return plan.predicted.likeness == Likeness::alike &&
               feasible(plan.predicted, open.budget) &&
               alike_unseen(plan, session.edges, session.ask(), sources, *want.budget.like);
    };
    if (!is_sure(*answer.plan)) {
        if (want.minimize != Minimize::time) return false;
        std::optional<Plan> sure;
        PlanOptions all = session.plan_options;
        all.front = true;
        for (const Plan& plan : answer_by(all).front)  // fastest first
            if (!sure && is_sure(plan)) sure = plan;
        if (!sure && answer.plain && session.spec.demands.via.empty()) {
            PlanOptions by_plain = session.plan_options;
            by_plain.demands.via = {demand_of(answer.plain->step, session.edges)};
            const Answer plain = answer_by(by_plain);
            if (plain.plan && is_sure(*plain.plan)) sure = plain.plan;
        }
        if (!sure) return false;
        const double saved = sure->predicted.seconds - answer.plan->predicted.seconds;
        if (session.spec.repeat * saved > preview_seconds(session)) return false;
        answer.plan = std::move(sure);
    }
    answer.plain.reset();  // its error is a guess
    session.answer = std::move(answer);
    return true;
}

/// That a result is equal but for rounding is nobody's demand, and nothing is looked at for its
/// sake. Where errors were measured all the same, to be shown, the same path is taken.
void choose_unseen(Session& session) {
    Scene unseen = session.scene;
    std::erase_if(unseen.facts, [](const auto& fact) {
        return fact.first.starts_with("run/") || fact.first.starts_with("result/") ||
               fact.first == "written";
    });
    unseen.range = unseen_scene(session.statistics).range;
    Answer chosen = answer_to(session, unseen);
    if (!chosen.plan) return;
    PlanOptions options = session.plan_options;
    options.demands.via.clear();
    for (const Step& step : chosen.plan->steps)
        options.demands.via.push_back({step.by->name, step.offer.with});
    Answer measured =
        plan(session.edges, session.ask(), session.sources(), session.profile, options);
    if (!measured.plan) return;
    session.answer->plan = std::move(measured.plan);
    session.answer->warnings = std::move(chosen.warnings);
}

}  // namespace

void ask_planner(Session& session) {
    const Request& want = session.want();
    const auto begin = std::chrono::steady_clock::now();
    const double looked = session.spent.preview;
    const auto searched = [&] {
        const double all =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        session.spent.search += all - (session.spent.preview - looked);
    };
    prepare_planning(session);
    if (session.errors == ErrorsWanted::for_choice && session.drawn == 0) {
        if (chooses_unseen(session)) return searched();
        look_at_data(session, true);
        prepare_planning(session);
    }
    const double usual = preview_seconds(session);
    session.answer = answer_to(session, session.scene);
    if (want.budget.error_yields && session.drawn > 0) choose_unseen(session);
    // A likeness compares likely errors with each other: they are of the same draws.
    const bool refines = want.budget.error && session.spec.planner == Planner::estimate;
    for (const int times : {4, 16}) {
        if (!refines || session.scene.draws == 0 || session.scene.exhausted ||
            is_fastest(*session.answer, want.minimize))
            break;
        const Answer likely = answer_to(session, session.scene.as_likely());
        if (worth(session.answer->plan, likely.plan, want.minimize, session.spec.repeat) <
            times * usual)
            break;
        Scene before = std::exchange(session.scene, drawn_more(session, times));
        prepare_planning(session);
        Answer answer = answer_to(session, session.scene);
        if (!answer.plan) {  // there was one, or nothing would have been worth the draws
            session.scene = std::move(before);
            prepare_planning(session);
            break;
        }
        session.drawn = times;
        session.answer = std::move(answer);
    }
    searched();
}

}  // namespace edgewise
