#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "cli/session/report.hpp"
#include "engine/merge.hpp"

namespace edgewise::cli {

/// The JSON of a picture of several channels: that of CLI.md, about all of them together, and
/// "channels" with what is each one's own. The same parameters as report_of.
nlohmann::ordered_json merge_report(const Merge& merge, double startup_seconds, bool with_run,
                                    const std::optional<Failure>& failure);

/// The result of a run in one line: files, size, channels, seconds, error.
std::string result_of(const Merge& merge);

}  // namespace edgewise::cli
