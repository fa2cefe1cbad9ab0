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
#include "measure/machine.hpp"
#include "measure/quantiles.hpp"
#include "measure/since.hpp"

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
/// The runs of one request: all paths once, with their errors, then in rounds those that could be
/// the fastest.
class Rounds {
 public:
    Rounds(const Planned& planned, Listener& messages, Audited& request,
           const std::vector<Plan>& plans, const PathSettings& settings, double resident_before)
        : request_(request),
          settings_(settings),
          runs_(planned, messages, request.paths, plans, settings, resident_before) {}

    void run_all() {
        // The chosen path first: its seconds bound how long the others may run.
        for (std::size_t i = 0; i < request_.paths.size(); ++i)
            if (path(i).chosen) runs_.run_first(i, std::numeric_limits<double>::infinity());
        for (std::size_t i = 0; i < request_.paths.size(); ++i)
            if (!path(i).chosen) runs_.run_first(i, patience());
        run_rounds();
        run_close_ones();
        catch_up();
    }

 private:
    const MeasuredPath& path(std::size_t i) const { return request_.paths[i]; }

    void run_rounds() {
        const auto wanted = [&](std::size_t i) { return path(i).chosen || may_win(i); };
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
}

/// @throws what the request ends with
Planned planned_for_running(const Query& query, const Engine& engine, Listener& messages) {
    Reached reached(ask(engine, query, {.runs = true}));
    reached.prepare({}, messages);
    return reached.plan();
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
    Rounds(planned, listener, request, tried.plans, settings, resident).run_all();
    request.warnings = listener.warnings();
    if (!request.chosen().measured())
        throw RunError(message("the chosen path failed: {}", request.chosen().failure));
    return request;
}

}  // namespace edgewise
