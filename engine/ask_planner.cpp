#include "engine/ask_planner.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <utility>

#include "engine/contest.hpp"
#include "engine/planned.hpp"
#include "measure/since.hpp"
#include "planner/alike.hpp"
#include "planner/choice.hpp"
#include "planner/priced_graph.hpp"
#include "planner/search.hpp"
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

/// The choice between paths of which nobody has seen a result.
class Unseen {
 public:
    explicit Unseen(const Planned& planned)
        : planned_(planned),
          want_(whatever_the_likeness(planned.want)),
          sources_(planned.sources()) {}

    /// By costs and guesses, and a few draws where these pay (contest.hpp); nothing where a preview
    /// of all facts has to decide.
    std::optional<Answer> answer() {
        Answer answer = answer_by(planned_, want_, planned_.guessed, planned_.plan_options);
        if (!want_.budget.like) return answer;  // no budget of any error
        if (!answer.plan) return std::nullopt;
        if (!is_sure(*answer.plan)) {
            if (want_.minimize != Minimize::time) return std::nullopt;
            std::optional<Plan> sure = fastest_sure(answer);
            if (!sure) return std::nullopt;
            // Of other jobs' results a preview of all is what there is, and of a description
            // guesses.
            const double saved = sure->predicted.seconds - answer.plan->predicted.seconds;
            const JobTraits& job = *planned_.want.job;
            const bool drawable = (job.of_rays() || job.of_points()) && has_samples();
            if (!drawable && planned_.query.repeat * saved > preview_seconds(planned_))
                return std::nullopt;
            Contest contest;
            if (drawable) contest = contest_of(planned_, *answer.graph, *sure);
            drawing_ += contest.seconds;
            answer.plan = contest.winner ? std::move(contest.winner) : std::move(sure);
        }
        if (answer.plain) answer.plain->error.reset();  // a guess
        return answer;
    }
    /// What drawing took [s].
    double drawing() const noexcept { return drawing_; }

 private:
    static Request whatever_the_likeness(Request want) {
        if (want.budget.like) want.budget.like->times = std::numeric_limits<double>::infinity();
        return want;
    }
    Ask ask() const { return {want_, planned_.guessed}; }
    bool has_samples() const {
        const auto& data = planned_.input.data;
        return !planned_.input.described && data && data->samples.data();
    }

    /// Whether a plan is as good as asked for, whatever a preview would show: its errors are those
    /// of the plain path, say, or none.
    bool is_sure(const Plan& plan) const {
        return plan.predicted.likeness == Likeness::alike &&
               feasible(plan.predicted, planned_.want.budget) &&
               alike_unseen(plan, planned_.engine.edges(), {planned_.want, planned_.guessed},
                            sources_, *planned_.want.budget.like);
    }

    std::optional<Plan> fastest_sure(const Answer& answer) const {
        PlanOptions options = planned_.plan_options;
        options.front = true;
        const Catalogue& edges = planned_.engine.edges();
        // Fastest first.
        for (Plan& each :
             plan(answer.graph, edges, ask(), planned_.engine.machine(), options).front)
            if (is_sure(each)) return std::move(each);
        if (!answer.plain || !planned_.query.demands.via.empty()) return std::nullopt;
        std::optional<Plan> plain =
            plan_of_steps(*answer.graph, {answer.plain->step}, edges, ask(), options);
        if (!plain) {  // with a parameter that nobody tries
            options.front = planned_.plan_options.front;
            options.demands.via = {demand_of(answer.plain->step, edges)};
            plain = answer_by(planned_, want_, planned_.guessed, options).plan;
        }
        if (!plain || !is_sure(*plain)) return std::nullopt;
        return plain;
    }

    const Planned& planned_;
    const Request want_;
    const std::vector<Source> sources_;
    double drawing_ = 0;
};

/// What somebody gets who does not ask for errors: of a result that is to be as good as linear
/// interpolation where a preview cannot pay, or equal but for rounding. Nothing where a preview
/// decides.
/// @param drawing  what drawing for it took is added [s]
std::optional<Answer> answer_unseen(const Planned& planned, double& drawing) {
    const Budget& budget = planned.want.budget;
    if (budget.error_yields && planned.drawn > 0)
        return answer_by(planned, planned.want, planned.guessed, planned.plan_options);
    if (planned.errors != ErrorsWanted::for_choice && !budget.like) return std::nullopt;
    Unseen unseen(planned);
    std::optional<Answer> answer = unseen.answer();
    drawing += unseen.drawing();
    return answer;
}

/// Takes the path of another answer: what is measured to be shown changes no choice.
/// @return the plan that was chosen by what was measured, where it is another
std::optional<Plan> take_path(const Planned& planned, Answer& answer, const Answer& of) {
    if (!of.plan) return std::nullopt;
    PlanOptions options = planned.plan_options;
    options.demands.via.clear();
    for (const Step& step : of.plan->steps)
        options.demands.via.push_back({step.by->name, step.offer.with});
    Request want = planned.want;
    if (want.budget.like) want.budget.like->times = std::numeric_limits<double>::infinity();
    Answer measured = answer_by(planned, want, planned.scene, options);
    // Demands leave room for steps in between, which may seem to be faster still.
    const std::vector<std::string> steps = of.plan->texts();
    if (!measured.plan || measured.plan->texts() != steps)
        measured.plan = plan_of_steps(*measured.graph, steps, planned.engine.edges(),
                                      {want, planned.scene}, options);
    if (!measured.plan) return std::nullopt;
    std::swap(answer.plan, measured.plan);
    answer.warnings = of.warnings;
    const bool other = measured.plan && measured.plan->texts() != answer.plan->texts();
    return other ? std::move(measured.plan) : std::nullopt;
}

/// Answers by what is known so far. @return whether that is enough
bool choose(Planned& planned) {
    const std::optional<Answer> unseen = answer_unseen(planned, planned.spent.preview);
    if (planned.drawn == 0 && planned.errors == ErrorsWanted::for_choice) {
        if (unseen) planned.answer = *unseen;
        return unseen.has_value();
    }
    planned.answer = answer_by(planned, planned.want, planned.scene, planned.plan_options);
    if (unseen && planned.query.planner == Planner::estimate)
        planned.seen_better = take_path(planned, planned.answer, *unseen);
    return true;
}

/// Whether no path is faster by so much, whatever its error. Then more draws can gain nothing.
bool is_fastest(const Answer& answer, Minimize minimize) {
    if (minimize != Minimize::time || !answer.plan) return false;
    if (answer.search == Search::shortest_path) return true;
    const std::optional<Route> fastest = fastest_route(answer.graph->real());
    return !fastest || fastest->label.seconds >= kWorth * answer.plan->predicted.seconds;
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
    for (bool is_chosen = choose(planned); const int times = next_draws(planned, is_chosen);) {
        Planned next = drawn(planned, times);
        choose(next);
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
