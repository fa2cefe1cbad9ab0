#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "cli/audit.hpp"

namespace edgewise::cli {

/// What there is without a planner: one path for all requests of a family (job, dimensions or
/// mode), the one that turns out best. Where it is not offered or breaks a budget, a request counts
/// with its most accurate path: what someone takes whose usual path will not do.
nlohmann::ordered_json fixed_paths(const std::vector<const AuditedRequest*>& requests);

}  // namespace edgewise::cli
