#pragma once

#include "graph/data.hpp"

namespace edgewise {

/// The value below which a share of the finite values of an input lies: exact for integers, else to
/// 1/65536 of the range.
/// @param low,high  of all values; @param share  0..1
double percentile_of(const Data& data, double low, double high, double share);

}  // namespace edgewise
