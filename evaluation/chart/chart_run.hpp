#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "charts/pictures.hpp"
#include "engine/engine.hpp"
#include "engine/path_runs.hpp"
#include "request/query.hpp"

namespace edgewise {

struct Planned;

/// What of a request is run for a chart.
struct ChartedRuns {
    PathSettings paths;
    bool repeat_given = false;   // long paths are run as often as short ones
    bool pictures = false;       // somebody will look at them
    std::set<std::string> only;  // paths to run, where it is not empty
    /// Told of the request when it is planned.
    std::function<void(const Planned&)> planned = {};
};

/// Told the share of the work that is done, and what is going on.
using ChartProgress = std::function<void(double share, const std::string& what)>;

/// One request, its paths run.
struct Charted {
    std::string machine;
    std::vector<Plan> plans;            // one a path
    std::vector<std::string> families;  // one a path
    std::vector<MeasuredPath> paths;
    std::size_t all_paths = 0;  // that there are
    std::optional<double> seconds_budget, error_budget;
    std::vector<Message> warnings;
    std::optional<charts::Pictures> pictures;
    bool interrupted = false;
};

/// What the paths of a request have in common that share their edges but not their parameters:
/// the edges, without those that only prepare the samples (`store`).
std::string family_of(const std::vector<std::string>& steps);

/// Paths that a chart would run, as path_text writes them.
struct Charting {
    std::vector<std::string> paths, wanted;  // wanted: those chosen or on the predicted front
    std::string chosen;                      // empty: none
};
/// What a chart of a request would run; nothing is run. @throws what the request would end with
Charting charting_of(const Query& query, const Engine& engine, const PathSettings& settings,
                     Listener& listener);

/// Plans a request without its budget of memory and runs its paths, interleaved. What stops the
/// listener ends the runs, not the chart.
/// @throws what the request would end with
Charted charted(const Query& query, const Engine& engine, const ChartedRuns& settings,
                const ChartProgress& progress, Listener& listener);

}  // namespace edgewise
