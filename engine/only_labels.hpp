#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "request/input.hpp"

namespace edgewise {

/// Makes background of all labels but some, in the samples in memory.
/// @param background  the value that is no label
/// @return a warning that names those that do not occur, or ""
/// @throws RequestError none of them occurs
Message keep_labels(Input& input, const std::vector<std::int64_t>& labels, double background,
                    std::pmr::memory_resource* memory);

}  // namespace edgewise
