#pragma once

#include <optional>
#include <string>

#include "graph/cost.hpp"
#include "graph/request.hpp"

namespace edgewise::cli {

/// Why a path was not chosen: the budget that it breaks, else what the plan is better in.
std::string why_not(const Predicted& other, const std::optional<Predicted>& chosen,
                    const Request& want);

/// "as good as linear (default), memory 512.0 MiB; least time"
std::string budget_text(const Request& want);

}  // namespace edgewise::cli
