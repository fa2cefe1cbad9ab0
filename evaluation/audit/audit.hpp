#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "engine/engine.hpp"
#include "engine/listener.hpp"
#include "engine/path_runs.hpp"
#include "graph/request.hpp"
#include "request/query.hpp"

namespace edgewise {

/// One request, all its paths run.
struct Audited {
    std::string family;  // job, dimensions or mode, and whether there are several views
    std::string planner, machine;
    Budget budget;
    bool bytes_given = false;
    Minimize minimize = Minimize::time;
    int frames = 1, threads = 1;
    double planning_seconds = 0;
    double shared_seconds = 0;  // of these: the preset, which the plain path needs as well
    /// What choosing is worth is held against it; absent where there is none, or it failed.
    std::optional<MeasuredPath> plain;
    std::vector<MeasuredPath> paths;
    std::size_t all_paths = 0;  // that there are
    std::vector<Message> warnings;

    const MeasuredPath& chosen() const;
};

/// What the measurements say about the planner's choice.
struct Verdict {
    const MeasuredPath* best = nullptr;
    double regret = 1;  // what was minimised, of the chosen path over the best one
    bool error_kept = true, bytes_kept = true, seconds_kept = true;

    bool kept() const noexcept { return error_kept && bytes_kept; }
};

/// Whether a path's measurements keep the budgets of a request. Of a rival the error itself counts;
/// of the chosen path a sampled error breaks the budget when its whole 95 % interval is beyond it.
bool keeps_budgets(const MeasuredPath& path, const Audited& request);
/// What is minimised, of a path that was measured.
double objective(const MeasuredPath& path, const Audited& request);
/// Regret is against the best path that keeps the budgets. Where none keeps the error's, against
/// the best of those that are as accurate as the most accurate one within its 95 % interval.
Verdict judge(const Audited& request);

/// What choosing is worth: seconds of the plain path over those of planning, without what the plain
/// path needs too, and of the chosen path. Above 1 it pays. Absent without a plain path.
std::optional<double> value_of(const Audited& request);

/// Plans a request and runs its paths, interleaved.
/// @throws RequestError, InputError, NoPlan, Cancelled; RunError where the chosen path fails
Audited audited(const Query& query, const Engine& engine, const PathSettings& settings,
                Listener& listener);

}  // namespace edgewise
