#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/session/path_runs.hpp"
#include "graph/request.hpp"

namespace edgewise::cli {

struct JobOptions;

/// One request of the file of an audit.
struct AuditRequest {
    std::vector<std::string> args;  // as on the command line
    std::string name;
    bool held_out = false;  // no fit has seen its like
};

/// One request, all its paths run.
struct AuditedRequest {
    AuditRequest asked;
    std::string family;  // job, dimensions or mode, and whether there are several views
    std::string planner, machine;
    Budget budget;
    bool bytes_given = false;
    Minimize minimize = Minimize::time;
    int frames = 1, threads = 1;
    double planning_seconds = 0;
    std::vector<MeasuredPath> paths;
    std::size_t all_paths = 0;  // that there are
    std::vector<std::string> warnings;
    int code = 0;  // of its failure
    std::string message;

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
bool keeps_budgets(const MeasuredPath& path, const AuditedRequest& request);
/// What is minimised, of a path that was measured.
double objective(const MeasuredPath& path, const AuditedRequest& request);
/// Regret is against the best path that keeps the budgets. Where none keeps the error's, against
/// the best of those that are as accurate as the most accurate one within its 95 % interval.
Verdict judge(const AuditedRequest& request);

/// Plans a request and runs its paths, interleaved.
/// @throws what the request itself would end with; Cancelled
AuditedRequest audited(const AuditRequest& asked, const JobOptions& options,
                       const PathSettings& settings);

nlohmann::ordered_json audit_entry(const AuditedRequest& request);
nlohmann::ordered_json audit_summary(const std::vector<AuditedRequest>& requests);

}  // namespace edgewise::cli
