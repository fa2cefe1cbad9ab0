#include <algorithm>
#include <nlohmann/json.hpp>

#include "charts/front.hpp"
#include "cli/chart/chart.hpp"
#include "cli/request/spoken.hpp"
#include "cli/session/report.hpp"
#include "graph/version.hpp"
#include "measure/quantiles.hpp"

namespace edgewise::cli {
namespace {

using Json = nlohmann::ordered_json;

/// As in the report of a run; `typical` is drawn, of the warm runs where there are any.
Json measured_json(const MeasuredPath& path) {
    if (!path.measured()) return nullptr;
    const std::vector<double> seconds =
        path.seconds.empty() ? std::vector<double>{*path.first} : path.seconds;
    return {{"seconds", seconds},
            {"median", median(seconds)},
            {"typical", path.typical()},
            {"first", *path.first},
            {"bytes", path.resident_bytes.value_or(path.bytes)},
            {"resident_bytes", path.resident_bytes ? Json(*path.resident_bytes) : Json()},
            {"error", to_json(path.error)}};
}

charts::Point point_of(const ChartedRequest& request, std::size_t i) {
    const MeasuredPath& path = request.paths[i];
    charts::Point point;
    point.path = path_text(path.steps);
    point.family = request.families[i];
    point.predicted = {path.predicted.seconds, {}, path.predicted.expected_bytes()};
    if (path.predicted.known) point.predicted.error = path.predicted.error;
    if (path.measured())
        point.measured = {path.typical(), {}, path.resident_bytes.value_or(path.bytes)};
    if (path.error) point.measured.error = path.error->nrmse;
    point.predicted_front = path.front;
    point.chosen = path.chosen;
    point.at = request.at;
    return point;
}

Json point_json(const ChartedRequest& request, std::size_t i, const charts::Point& point) {
    const MeasuredPath& path = request.paths[i];
    Json json;
    if (request.at) json["at"] = *request.at;
    json["steps"] = path.steps;
    json["family"] = point.family;
    json["plan"] = to_json(request.plans[i]);
    json["predicted"] = to_json(path.predicted);
    json["measured"] = measured_json(path);
    json["front"] = point.front;
    json["predicted_front"] = path.front;
    json["chosen"] = path.chosen;
    if (!path.failure.empty()) json["failure"] = spoken(path.failure);
    return json;
}

Json peers_json(const std::vector<charts::Peer>& peers) {
    Json json = Json::array();
    for (const charts::Peer& peer : peers)
        json.push_back({{"name", peer.name}, {"seconds", peer.seconds}, {"error", peer.error}});
    return json;
}

/// Every one once, in the order in which they came.
std::vector<std::string> warnings_of(const std::vector<ChartedRequest>& requests) {
    std::vector<Message> warnings;
    for (const ChartedRequest& request : requests)
        for (const Message& warning : request.warnings)
            if (std::find(warnings.begin(), warnings.end(), warning) == warnings.end())
                warnings.push_back(warning);
    return spoken(warnings);
}

}  // namespace

charts::Table table_of(const std::vector<ChartedRequest>& requests, const ChartSettings& settings,
                       const std::string& swept) {
    charts::Table table;
    table.title = settings.title;
    table.peers = settings.peers;
    table.swept = swept;
    for (const ChartedRequest& request : requests)
        for (std::size_t i = 0; i < request.paths.size(); ++i)
            table.points.push_back(point_of(request, i));
    charts::mark_front(table.points);
    // A budget that is swept itself is no line.
    if (!requests.empty() && swept != "max-time")
        table.seconds_budget = requests.front().seconds_budget;
    if (!requests.empty() && swept != "max-error")
        table.error_budget = requests.front().error_budget;
    return table;
}

Json document_of(const std::vector<ChartedRequest>& requests, const ChartSettings& settings,
                 const charts::Table& table) {
    Json json = {{"schema", 1}, {"version", version()}};
    json["warnings"] = warnings_of(requests);
    if (std::any_of(requests.begin(), requests.end(),
                    [](const ChartedRequest& request) { return request.interrupted; }))
        json["interrupted"] = true;
    json["request"] = requests.empty() ? Json() : requests.front().request;
    json["machine"] = requests.empty() ? Json() : Json(requests.front().machine);
    json["settings"] = {
        {"limit", settings.runs.paths.limit},
        {"repeat", settings.runs.paths.repeat},
        {"verify", settings.runs.paths.samples ? Json(*settings.runs.paths.samples) : Json()},
        {"seed", settings.runs.paths.seed}};
    std::size_t all = 0;
    for (const ChartedRequest& request : requests) all = std::max(all, request.all_paths);
    json["paths"] = all;
    if (!table.swept.empty()) {
        Json values = Json::array();
        for (const ChartedRequest& request : requests) values.push_back(*request.at);
        json["sweep"] = {{"option", table.swept}, {"values", values}};
    }
    json["points"] = Json::array();
    std::size_t place = 0;
    for (const ChartedRequest& request : requests)
        for (std::size_t i = 0; i < request.paths.size(); ++i)
            json["points"].push_back(point_json(request, i, table.points[place++]));
    json["peers"] = peers_json(settings.peers);
    return json;
}

}  // namespace edgewise::cli
