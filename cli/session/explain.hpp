#pragma once

#include <optional>
#include <string>

#include "graph/cost.hpp"
#include "graph/request.hpp"

namespace edgewise {
struct Planned;
struct Run;
struct TakenPreset;
}  // namespace edgewise

namespace edgewise::cli {

/// The plan and its alternatives as a table.
/// @param all_refused  edges that were refused one by one, else folded by reason
std::string explanation_of(const Planned& planned, bool all_refused);
/// The result of a run in one line: files, size, path, seconds, error.
std::string result_of(const Planned& planned, const Run& run);
/// "preset mr-head over 12 to 430"
std::string preset_text(const TakenPreset& preset);
/// Measured against predicted seconds of the run, step by step; and, where it was verified, its
/// error.
/// @param explained  the plan is shown as well
std::string measurement_of(const Planned& planned, const Run& run, bool explained);

/// Why a path was not chosen: the budget that it breaks, else what the plan is better in.
std::string why_not(const Predicted& other, const std::optional<Predicted>& chosen,
                    const Request& want);

/// "as good as linear (default), memory 512.0 MiB; least time"
std::string budget_text(const Request& want);

}  // namespace edgewise::cli
