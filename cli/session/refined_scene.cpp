#include "cli/session/refined_scene.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "cli/session/known_scene.hpp"
#include "cli/session/session.hpp"
#include "planner/alike.hpp"

namespace edgewise::cli {
namespace {

constexpr double kWorth = 0.9;  // of what is minimised
constexpr double kRuns = 1000;
constexpr double kMost = 2;  // [s] that drawing more may take, whatever it saves
// What a cluster takes on one core, looks at others included, by and large: points of warps, rays
// of pictures [s].
constexpr double kPoint = 3e-5, kRay = 1e-3;

Answer answer_to(const Session& session, const Scene& scene) {
    return plan(session.edges, {session.want(), scene}, session.sources(), session.profile,
                session.plan_options);
}

/// Whether any path is that much faster, whatever its error: else there is nothing to look for.
bool is_fastest(const Answer& answer, Minimize minimize) {
    return minimize == Minimize::time && answer.plan && !answer.front.empty() &&
           answer.front.front().predicted.seconds >= kWorth * answer.plan->predicted.seconds;
}

/// How long drawing may take for what the likely errors promise [s]; 0: there is nothing to gain.
double worth(const std::optional<Plan>& sure, const std::optional<Plan>& likely,
             Minimize minimize) {
    if (!likely || !sure) return 0;
    const Predicted &has = sure->predicted, &could = likely->predicted;
    if (minimize == Minimize::memory) return could.bytes < kWorth * has.bytes ? kMost : 0;
    if (minimize == Minimize::error || could.seconds >= kWorth * has.seconds) return 0;
    return std::min(kMost, kRuns * (has.seconds - could.seconds));
}

Scene drawn_more(Session& session, int times) {
    const auto begin = std::chrono::steady_clock::now();
    Scene scene = known_scene(session.edges, *session.input, session.statistics, session.want(),
                              session.memory.get(), times, untried(session.demands, session.edges));
    session.spent.preview +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return scene;
}

/// Without a look at the data, where the fastest path that is not barred is as good as asked for
/// whatever a preview would show: by the plain way's own errors, say, or exactly.
bool chooses_unseen(Session& session) {
    const Request& want = session.want();
    if (!want.budget.like) {  // no budget of any error
        session.answer = answer_to(session, session.scene);
        return true;
    }
    Request open = want;
    open.budget.like->times = std::numeric_limits<double>::infinity();
    const std::vector<Source> sources = session.sources();
    Answer answer =
        plan(session.edges, {open, session.scene}, sources, session.profile, session.plan_options);
    if (!answer.plan ||
        !alike_unseen(*answer.plan, session.edges, session.ask(), sources, *want.budget.like))
        return false;
    answer.plain.reset();  // its error is a guess
    session.answer = std::move(answer);
    return true;
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
    const double usual =
        static_cast<double>(session.scene.draws) * (want.job == Job::warp ? kPoint : kRay);
    session.answer = answer_to(session, session.scene);
    // A likeness compares likely errors with each other: they are of the same draws.
    const bool refines = want.budget.error && session.wish.planner == Planner::estimate;
    for (const int times : {4, 16}) {
        if (!refines || session.scene.draws == 0 || session.scene.exhausted ||
            is_fastest(*session.answer, want.minimize))
            break;
        const Answer likely = answer_to(session, session.scene.as_likely());
        if (worth(session.answer->plan, likely.plan, want.minimize) < times * usual) break;
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

}  // namespace edgewise::cli
