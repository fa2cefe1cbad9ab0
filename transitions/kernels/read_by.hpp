#pragma once

#include <string>

#include "graph/transition.hpp"
#include "transitions/filters/filter.hpp"

namespace edgewise {

/// Why samples of some content cannot be read by a filter, or "".
std::string not_read_by(const Filter& filter, const std::string& content, const Ask& ask);

}  // namespace edgewise
