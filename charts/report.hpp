#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "charts/pictures.hpp"
#include "charts/table.hpp"

namespace edgewise::charts {

/// Something said about a name.
using Fact = std::pair<std::string, std::string>;

/// A line of the table of predictions and measurements.
struct ReportStep {
    std::string name, note;
    Values predicted, measured;
    std::string no_prediction;  // why there is none, or ""
    std::string no_error;       // why none was measured, or ""
};

/// A path that nothing beats.
struct ReportPath {
    std::string path;
    Values predicted;
    bool chosen = false;
    std::string why_not;  // it was not chosen
};

/// All that the page of one run shows.
struct Report {
    std::string title, command;
    std::vector<std::string> warnings;
    std::vector<Fact> request, machine;
    std::optional<ReportPicture> picture, difference;
    double difference_scale = 0;  // [value] of the strongest colour
    std::string no_difference;    // why there is none
    std::vector<ReportStep> steps;
    ReportStep total;
    std::string graph;     // SVG, or "":
    std::string no_graph;  // why there is none
    std::vector<ReportPath> front;
    std::vector<Fact> refused;        // edges, and why
    nlohmann::ordered_json document;  // the same for scripts
};

/// One HTML file that needs nothing else, not even scripts. Numbers are rounded where they are read
/// and whole in the `value` of their <data> elements.
std::string page_of(const Report& report);

}  // namespace edgewise::charts
