#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "cli/session/report.hpp"
#include "engine/series.hpp"

namespace edgewise::cli {

/// The report of a render, of all time points: seconds are theirs together.
nlohmann::ordered_json series_report(const Series& series, double startup_seconds, bool with_run,
                                     const std::optional<Failure>& failure);

/// What a run ends with, in one line.
std::string result_of(const Series& series);

}  // namespace edgewise::cli
