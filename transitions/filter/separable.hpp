#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Sums of products of weights along the axes: a row, a column and a line of slices after one
/// another, for each product that the kernel consists of.
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Needs   a sum whose products have fewer weights than the kernel; of several products samples
///         that are finite
/// Work    two operations for each weight, of rows also for samples around tiles
/// Error   that of filtering_edge(); the products agree with the kernel to 2^-40
/// Source  [W93] EQ 6; elimination with complete pivoting: Bebendorf 2000
Transition filter_separable();

}  // namespace edgewise
