#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "graph/plan.hpp"
#include "reference/verify.hpp"

namespace edgewise::cli {

struct Session;

/// How a request ended that did not end well.
struct Failure {
    int code = 1;  // of the process
    std::string message;
};

/// The JSON of CLI.md of `warp`, `render` and `plan`; what is not known is null.
/// @param with_run  with what was measured and written
nlohmann::ordered_json report_of(const Session& session, bool with_run,
                                 const std::optional<Failure>& failure);
/// Of a request that failed before there was one, and of the other verbs.
nlohmann::ordered_json failure_of(int code, const std::string& message);
nlohmann::ordered_json to_json(const Predicted& predicted);
/// {"steps": [...], "predicted": {...}}
nlohmann::ordered_json to_json(const Plan& plan);
/// null where nothing was verified
nlohmann::ordered_json to_json(const std::optional<Verified>& error);
/// What was asked for: the report's "request".
nlohmann::ordered_json request_json(const Session& session);

/// Indented, UTF-8, with a line's end.
std::string text_of(const nlohmann::ordered_json& json);

}  // namespace edgewise::cli
