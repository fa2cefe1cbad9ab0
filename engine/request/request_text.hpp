#pragma once

#include <string>

#include "graph/request.hpp"

namespace edgewise {

/// All of a request that its result depends on, to the last bit: not its budgets, nor how many
/// threads or ranks work on it. For fingerprints, not for readers: maps are bytes.
std::string request_text(const Request& want);

}  // namespace edgewise
