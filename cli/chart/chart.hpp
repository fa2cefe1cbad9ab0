#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "charts/pictures.hpp"
#include "charts/table.hpp"
#include "cli/session/path_runs.hpp"

namespace edgewise::cli {

struct JobOptions;

/// What a chart is asked for in addition to its request.
struct ChartSettings {
    PathSettings paths;
    bool repeat_given = false;  // long paths are run as often as short ones
    bool pictures = false;      // somebody will look at them
    std::vector<charts::Peer> peers;
    std::string title;
};

/// Told the share of the work that is done, and what is going on.
using ChartProgress = std::function<void(double share, const std::string& what)>;

/// One request, its paths run.
struct Charted {
    nlohmann::ordered_json request;
    std::string machine;
    std::vector<nlohmann::ordered_json> plans;  // one a path
    std::vector<std::string> families;          // one a path
    std::vector<MeasuredPath> paths;
    std::size_t all_paths = 0;  // that there are
    std::optional<double> seconds_budget, error_budget;
    std::optional<double> at;  // of a sweep
    std::vector<std::string> warnings;
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
Charting charting_of(const JobOptions& options, const PathSettings& settings);

/// Plans a request without its budgets in memory and runs its paths, interleaved. A signal ends the
/// runs, not the chart.
/// @param only  the paths to run, where it is not empty
/// @throws what the request would end with
Charted charted(const JobOptions& options, const ChartSettings& settings,
                const std::set<std::string>& only, const ChartProgress& progress);

/// Points of all requests (of a sweep one a value) with the measured front marked.
charts::Table table_of(const std::vector<Charted>& requests, const ChartSettings& settings,
                       const std::string& swept);
/// The `.json` of a chart. @param table  of the same requests
nlohmann::ordered_json document_of(const std::vector<Charted>& requests,
                                   const ChartSettings& settings, const charts::Table& table);

}  // namespace edgewise::cli
