#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "planner/margin.hpp"

namespace edgewise::cli {

struct Session;

/// All paths of a request. What pilots measured of them replaces predictions.
std::unique_ptr<Candidates> candidates_of(const Session& session);

/// Works out how sure the choice is, once there is a plan.
void weigh(Session& session);

/// Margin and rivals as lines of an explanation; "" where nothing was weighed.
std::string margin_text(const Session& session);

/// {"steps": [{"step", "factor", "instead", "spread", "inside"}], "toss_up", "late"}
nlohmann::ordered_json margin_json(const Margin& margin);
/// [{"steps", "predicted", "loses": {"seconds", "bytes", "error"}, "breaks", "differs", "faster",
/// "chance", "toss_up"}]
nlohmann::ordered_json rivals_json(const Margin& margin);

}  // namespace edgewise::cli
