#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "charts/pictures.hpp"
#include "charts/table.hpp"

namespace edgewise::charts {

/// One HTML file that needs nothing else: data, script, d3 with its licence, pictures.
/// @param document  what the `.json` of the chart holds: the page shows its points, which are those
///                  of the table, in the same order
/// @param pictures  absent: a click shows numbers alone
std::string page_of(const Table& table, nlohmann::ordered_json document, const Pictures* pictures);

}  // namespace edgewise::charts
