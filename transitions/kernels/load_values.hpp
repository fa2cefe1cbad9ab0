#pragma once

#include <cstdint>

#include "transitions/kernels/grid.hpp"

namespace edgewise::kernels {

/// (value - subtract) of n samples from an index on, of a whole volume of one channel, in f64.
void load_values(const Grid& volume, std::int64_t first, std::int64_t n, double subtract,
                 double* out);

}  // namespace edgewise::kernels
