#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "settings/settings.hpp"

namespace edgewise {

/// All that is set of a query, so that query_of() makes the same one of it: what differs from a
/// query in which nothing is, in the order of the settings, steps of the geometry last.
/// @throws RequestError for a transfer function that a program made: it has no name
std::vector<Given> told(const Query& query);

/// {"job": "render", "input": "ct/", "mode": "xray", "steps": [{"rotate": [20, 0, 0]}]}: the
/// settings by their names, steps in the order in which they apply.
nlohmann::ordered_json json_of(const Query& query);
/// The query of such an object. @throws SettingError, RequestError
Query query_of(const nlohmann::ordered_json& json, const Catalogue& edges);

}  // namespace edgewise
