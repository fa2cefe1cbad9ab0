#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <malloc.h>

#include "engine/paths.hpp"
#include "engine/reached.hpp"
#include "evaluation/audit/audit.hpp"
#include "graph/errors.hpp"
#include "graph/label_surface.hpp"
#include "measure/machine.hpp"
#include "measure/quantiles.hpp"
#include "measure/since.hpp"
#include "planner/alike.hpp"
#include "scene/ring_free.hpp"
#include "transitions/filters/like_linear.hpp"

namespace edgewise {
namespace {

using Clock = std::chrono::steady_clock;

/// A path slower than the best by this factor needs no further runs, and none is waited for that
/// takes longer than the next: it cannot be the fastest.
constexpr double kNoRival = 1.5, kHopeless = 4;
constexpr double kPatience = 0.25;  // [s]; shorter runs are never given up: their errors tell
/// Runs up to kCheap are repeated at least kFewRuns times: their predicted seconds are judged too.
constexpr double kCheap = 0.05;  // [s]
constexpr int kFewRuns = 3;
/// Paths this close to the best are run on until they have kMoreRuns times the runs, or for
/// kMoreSeconds: the least of several medians is too small by what they scatter.
constexpr double kClose = 1.15, kMoreSeconds = 0.5;
constexpr int kMoreRuns = 4;
constexpr double kAsLongAsItTakes = std::numeric_limits<double>::infinity();
/// The runs of one request: all paths once, with their errors, then in rounds those that could be
/// the fastest.
class Rounds {
 public:
    Rounds(const Planned& planned, Listener& messages, Audited& request,
           const std::vector<Plan>& plans, std::optional<std::size_t> plain,
           const PathSettings& settings, double resident_before)
        : request_(request),
          plain_(plain),
          settings_(settings),
          runs_(planned, messages, request.paths, plans, settings, resident_before) {}

    void run_all() {
        // The chosen path first: its seconds bound how long the others may run.
        for (std::size_t i = 0; i < request_.paths.size(); ++i)
            if (path(i).chosen) runs_.run_first(i, kAsLongAsItTakes);
        for (std::size_t i = 0; i < request_.paths.size(); ++i)
            if (!path(i).chosen) runs_.run_first(i, i == plain_ ? kAsLongAsItTakes : patience());
        run_rounds();
        run_close_ones();
        catch_up();
    }

 private:
    const MeasuredPath& path(std::size_t i) const { return request_.paths[i]; }

    void run_rounds() {
        const auto wanted = [&](std::size_t i) {
            return path(i).chosen || i == plain_ || may_win(i);
        };
        for (int round = 0; round < settings_.repeat; ++round) runs_.run_round(round, wanted);
    }

    /// The best may have seemed faster in its first runs than in all: who was left behind for that
    /// is run to the end after all.
    void catch_up() {
        const auto missing = [&](std::size_t i) {
            const auto runs = static_cast<int>(path(i).seconds.size());
            return runs < settings_.repeat && may_win(i);
        };
        for (int round = 0; round < settings_.repeat; ++round) runs_.run_round(round, missing);
    }

    void run_close_ones() {
        const auto begin = Clock::now();
        for (int round = settings_.repeat; round < kMoreRuns * settings_.repeat; ++round) {
            if (since(begin) > kMoreSeconds) break;
            bool rival = false;
            runs_.run_round(round, [&](std::size_t i) {
                if (path(i).chosen) return true;
                const bool close = is_close(i);
                rival = rival || close;
                return close;
            });
            if (!rival) break;
        }
    }

    double patience() const {
        const MeasuredPath& best = this->best();
        if (!best.measured()) return std::numeric_limits<double>::infinity();
        return std::max(kPatience, kHopeless * best.typical());
    }

    /// The least median of the paths that keep the budgets; of the chosen one where none does.
    const MeasuredPath& best() const {
        const MeasuredPath* best = nullptr;
        for (const MeasuredPath& path : request_.paths)
            if (path.measured() && keeps_budgets(path, request_) &&
                (!best || path.typical() < best->typical()))
                best = &path;
        return best ? *best : request_.chosen();
    }

    /// Until its least time is beyond the best by more than what that scatters.
    bool may_win(std::size_t i) const {
        const MeasuredPath &path = this->path(i), &best = this->best();
        if (path.seconds.empty())
            return *path.first <= std::max(kPatience, kHopeless * best.typical());
        const auto few = static_cast<std::size_t>(kFewRuns);
        if (path.least() < kCheap && path.seconds.size() < few) return true;
        return path.least() <= kNoRival * best.typical() + 3 * scatter(best.seconds);
    }

    bool is_close(std::size_t i) const {
        const MeasuredPath &path = this->path(i), &best = this->best();
        return keeps_budgets(path, request_) && path.least() <= kClose * best.typical();
    }

    static double scatter(const std::vector<double>& seconds) {
        if (seconds.empty()) return 0;
        const double middle = median(seconds);
        std::vector<double> distances;
        for (const double one : seconds) distances.push_back(std::abs(one - middle));
        return median(distances);
    }

    Audited& request_;
    const std::optional<std::size_t> plain_;  // place of the plain path
    const PathSettings& settings_;
    PathRuns runs_;
};

std::string family_of(const Request& want) {
    const std::string family = want.job->of_rays()
                                   ? fmt::format("render {}", name_of(want.mode))
                                   : fmt::format("{} {}D", name_of(want.job), want.axes);
    return want.frames > 1 ? family + ", several views" : family;
}

void describe(Audited& request, const Planned& planned) {
    const Request& want = planned.want;
    request.family = family_of(want);
    request.planner = name_of(planned.query.planner);
    request.machine = planned.engine.machine().name;
    request.budget = want.budget;
    request.bytes_given = planned.query.max_memory.has_value();
    request.minimize = want.minimize;
    request.frames = want.frames;
    request.threads = want.threads;
    request.planning_seconds = planned.answer.seconds;
    request.shared_seconds = planned.spent.preset;
}

/// @throws what the request ends with
Planned planned_for_running(const Query& query, const Engine& engine, Listener& messages) {
    Reached reached(ask(engine, query, {.runs = true}));
    reached.prepare({}, messages);
    return reached.plan();
}

/// The plain path of a request; of one with budgets of its own, what it would be compared with
/// without them. Nothing where no edge offers one.
std::optional<std::string> plain_step(const Planned& planned) {
    if (planned.answer.plain) return planned.answer.plain->step;
    const Request& want = planned.want;
    if (shows_labels(want)) return std::nullopt;
    Like like = like_linear(want.field);
    if (want.job->of_rays()) {
        const Statistics& values = planned.statistics;
        like.step =
            ring_free_step(want, values.low, values.high, seen_slope(*planned.input.data, want));
    }
    const Scene likely = planned.scene.as_likely();
    const auto plain = plain_way(planned.engine.edges(), {want, likely}, planned.sources(), like);
    return plain ? std::optional(plain->step) : std::nullopt;
}

/// The plan of a step alone, whatever the budgets.
std::optional<Plan> plan_alone(const std::string& step, const Planned& planned) {
    const Catalogue& edges = planned.engine.edges();
    Request want = planned.want;
    want.budget = {};
    want.minimize = Minimize::time;
    PlanOptions options = planned.plan_options;
    options.front = false;
    options.demands = {.via = {demand_of(step, edges)}, .without = {}};
    for (const Transition& edge : edges)
        if (edge.name != options.demands.via[0].name)
            options.demands.without.push_back({edge.name});
    return plan(edges, {want, planned.scene}, planned.sources(), planned.engine.machine(), options)
        .plan;
}

/// The plain path's place among those that are run, to which it is added where it is not one of
/// them: a value of a parameter that nobody tries, or beyond the limit.
std::optional<std::size_t> with_plain(const Planned& planned, Audited& request, TriedPaths& tried) {
    const std::optional<std::string> step = plain_step(planned);
    if (!step) return std::nullopt;
    const std::vector<std::string> steps = {*step};
    for (std::size_t i = 0; i < request.paths.size(); ++i)
        if (request.paths[i].steps == steps) return i;
    std::optional<Plan> plan = plan_alone(*step, planned);
    if (!plan || plan->texts() != steps) return std::nullopt;
    MeasuredPath path;
    path.steps = steps;
    path.predicted = plan->predicted;
    request.paths.push_back(std::move(path));
    tried.plans.push_back(std::move(*plan));
    return request.paths.size() - 1;
}

}  // namespace

Audited audited(const Query& query, const Engine& engine, const PathSettings& settings,
                Listener& listener) {
    malloc_trim(0);  // so that earlier requests do not show in what this process holds
    Audited request;
    const Planned planned = planned_for_running(query, engine, listener);
    planned.memory->trim();
    const double resident = resident_now() - static_cast<double>(planned.memory->used());
    describe(request, planned);
    TriedPaths tried = tried_paths(planned, settings.limit, settings.seed);
    request.all_paths = tried.all;
    const std::vector<std::string> chosen = planned.answer.plan->texts();
    request.paths = unmeasured(tried, &chosen);
    const std::size_t paths = request.paths.size();
    const auto at = with_plain(planned, request, tried);
    Rounds(planned, listener, request, tried.plans, at, settings, resident).run_all();
    if (at && request.paths[*at].measured()) request.plain = request.paths[*at];
    request.paths.resize(paths);
    request.warnings = listener.warnings();
    if (!request.chosen().measured())
        throw RunError(message("the chosen path failed: {}", request.chosen().failure));
    return request;
}

}  // namespace edgewise
