#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "graph/plan.hpp"
#include "reference/verify.hpp"

namespace edgewise {
struct Looked;
class Listener;
class Reached;
}  // namespace edgewise

namespace edgewise::cli {

/// How a request ended that did not end well.
struct Failure {
    int code = 1;  // of the process
    std::string message;
};

/// The JSON of CLI.md of `warp`, `render` and `plan`; what is not known is null.
/// @param startup_seconds  of the process, before it took the request
/// @param with_run  with what was measured and written
nlohmann::ordered_json report_of(const Reached& reached, const Listener& messages,
                                 double startup_seconds, bool with_run,
                                 const std::optional<Failure>& failure);
/// Of a request that failed before there was one, and of the other verbs.
nlohmann::ordered_json failure_of(int code, const std::string& message);
nlohmann::ordered_json to_json(const Predicted& predicted);
/// {"steps": [...], "predicted": {...}}
nlohmann::ordered_json to_json(const Plan& plan);
/// null where nothing was verified
nlohmann::ordered_json to_json(const std::optional<Verified>& error);
/// What was asked for: the report's "request".
nlohmann::ordered_json request_json(const Reached& reached);
/// Likewise, of a request that is looked at.
nlohmann::ordered_json request_json(const Looked& looked);

/// Indented, UTF-8, with a line's end.
std::string text_of(const nlohmann::ordered_json& json);

}  // namespace edgewise::cli
