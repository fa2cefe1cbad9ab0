#include "cli/session/refined_scene.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "cli/session/known_scene.hpp"
#include "cli/session/session.hpp"

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

}  // namespace

void ask_planner(Session& session) {
    const Request& want = session.want();
    const double usual =
        static_cast<double>(session.scene.draws) * (want.job == Job::warp ? kPoint : kRay);
    prepare_planning(session);
    const auto begin = std::chrono::steady_clock::now();
    session.answer = answer_to(session, session.scene);
    if (session.wish.planner != Planner::estimate) return;
    for (const int times : {4, 16}) {
        if (session.scene.draws == 0 || session.scene.exhausted ||
            is_fastest(*session.answer, want.minimize))
            break;
        const Answer likely = answer_to(session, session.scene.as_likely());
        if (worth(session.answer->plan, likely.plan, want.minimize) < times * usual) break;
        Scene before = std::exchange(session.scene, known_scene(*session.input, session.statistics,
                                                                want, session.memory.get(), times));
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
    session.answer->seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace edgewise::cli
