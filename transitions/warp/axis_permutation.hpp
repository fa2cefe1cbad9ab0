#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Exact copies by a signed permutation of the axes.
/// Edge    object/scalar -> screen/scalar (to=screen): every view is a signed permutation and a
///         shift by whole samples; type and value map are kept
///         object/scalar -> aligned/scalar (to=aligned): volumes that are rendered; in each view
///         the input axis along which parallel rays advance fastest becomes z, depth increasing,
///         and the other two keep their order. Views that look along the same axis share one copy.
///         Where views differ in extent, a copy's own stands in Data::what.extent
/// Needs   matrices exact to 1e-12 and shifts to 1e-9 samples; for to=screen a value of `outside`
///         that the stored type can hold, if it is needed at all
/// Work    reads and writes every sample once, in squares that keep lines of the cache whole
/// Error   none
/// Source  [W93] 3.6.5 (90 degree turns); principal axis: Lacroute, Levoy 1994
Transition axis_permutation_warp();

}  // namespace edgewise
