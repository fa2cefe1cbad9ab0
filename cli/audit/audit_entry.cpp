#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/audit/audit.hpp"
#include "cli/request/spoken.hpp"
#include "cli/session/report.hpp"
#include "measure/quantiles.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

/// @param all  every single run as well
Json path_json(const MeasuredPath& path, bool all) {
    Json measured;
    if (path.measured()) {
        measured = {{"seconds", path.typical()},   {"least", path.least()},
                    {"first", *path.first},        {"runs", path.seconds.size()},
                    {"bytes", path.bytes},         {"resident_bytes", or_null(path.resident_bytes)},
                    {"error", to_json(path.error)}};
        if (all) measured["all_seconds"] = path.seconds;
    }
    Json json = {{"steps", path.steps},
                 {"predicted", to_json(path.predicted)},
                 {"measured", measured},
                 {"front", path.front},
                 {"as_good", path.predicted.likeness == Likeness::alike}};
    if (path.chosen) json["chosen"] = true;
    if (path.given_up) {
        json["cancelled"] = true;
        json["seconds_at_least"] = *path.given_up;
    }
    if (!path.failure.empty()) json["failure"] = spoken(path.failure);
    return json;
}

Json head_of(const AuditedRequest& request) {
    Json json = {{"args", request.asked.args}};
    if (!request.asked.name.empty()) json["name"] = request.asked.name;
    json["held_out"] = request.asked.held_out;
    if (request.code == 0) return json;
    json["error"] = {{"code", request.code}, {"message", request.message}};
    return json;
}

}  // namespace

Json audit_entry(const AuditedRequest& request) {
    Json json = head_of(request);
    if (request.code != 0) return json;
    const MeasuredPath& chosen = request.chosen();
    const Verdict verdict = judge(request);
    json["family"] = request.family;
    json["planner"] = request.planner;
    json["machine"] = request.machine;
    json["threads"] = request.threads;
    json["frames"] = request.frames;
    json["minimize"] = name_of(request.minimize);
    json["budget"] = {{"error", or_null(request.budget.error)},
                      {"default", request.budget.like ? Json(request.budget.like->name) : Json()},
                      {"seconds", or_null(request.budget.seconds)},
                      {"bytes", request.bytes_given ? or_null(request.budget.bytes) : Json()}};
    json["chosen"] = path_json(chosen, true);
    json["best"] = path_json(*verdict.best, true);
    json["regret"] = verdict.regret;
    json["predicted_over_measured"] = chosen.predicted.seconds / chosen.typical();
    json["error_within_budget"] = verdict.error_kept;
    json["bytes_within_budget"] = verdict.bytes_kept;
    json["seconds_within_budget"] = verdict.seconds_kept;
    json["planning_seconds"] = request.planning_seconds;
    json["shared_seconds"] = request.shared_seconds;
    json["plain"] = request.plain ? path_json(*request.plain, true) : Json();
    json["plain_seconds"] = request.plain ? Json(request.plain->typical()) : Json();
    json["value"] = or_null(value_of(request));
    json["paths"] = request.paths.size();
    json["all_paths"] = request.all_paths;
    json["measured_paths"] = Json::array();
    for (const MeasuredPath& path : request.paths)
        json["measured_paths"].push_back(path_json(path, false));
    json["warnings"] = spoken(request.warnings);
    return json;
}

}  // namespace edgewise::cli
