#pragma once

#include "engine/request/spec.hpp"
#include "graph/filtering.hpp"

namespace edgewise {

/// The kernel that a spec names, over so many axes. Of a file it is the samples as they are:
/// weights of a sum; of morphology heights, or, where all are 0 or 1, the places of a flat kernel
/// that are 1. NaN is a hole.
/// @throws RequestError sizes that make no sense, kernels of more than 2^22 places
/// @throws InputError   of the file
Filtering filtering_of(const FilterSpec& spec, int axes);

}  // namespace edgewise
