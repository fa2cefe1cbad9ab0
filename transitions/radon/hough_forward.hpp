#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Each sample that is at least the threshold votes, at each angle, for the line nearest to it.
///
/// Edge    object/scalar -> hough/scalar, see radon_edge()
/// Shape   whole numbers in f32: no line has 2^24 votes
/// Needs   Hough votes
/// Work    7 operations, one by one, for each angle and sample that votes; these are counted
/// Error   none
/// Source  Duda, Hart, Comm. ACM 15(1), 1972; [W93] 2.4
Transition hough_forward();

}  // namespace edgewise
