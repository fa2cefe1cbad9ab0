#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "charts/table.hpp"
#include "evaluation/chart/chart_run.hpp"

namespace edgewise::cli {

/// What a chart is asked for in addition to its request.
struct ChartSettings {
    ChartedRuns runs;
    std::vector<charts::Peer> peers;
    std::string title;
};

/// One request of a chart.
struct ChartedRequest : Charted {
    nlohmann::ordered_json request;  // as a report has it
    std::optional<double> at;        // of a sweep
};

/// Points of all requests (of a sweep one a value) with the measured front marked.
charts::Table table_of(const std::vector<ChartedRequest>& requests, const ChartSettings& settings,
                       const std::string& swept);
/// The `.json` of a chart. @param table  of the same requests
nlohmann::ordered_json document_of(const std::vector<ChartedRequest>& requests,
                                   const ChartSettings& settings, const charts::Table& table);

}  // namespace edgewise::cli
