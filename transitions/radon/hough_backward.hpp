#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Each line counts the samples that vote for it. In a row (or column, where these are met less
/// steeply) these lie side by side, so that two running counts tell their number.
///
/// Edge    object/scalar -> hough/scalar, see radon_edge()
/// Shape   as hough.forward
/// Needs   Hough votes
/// Work    for each angle min(|cos|, |sin|) of the samples (mean 0.37), and one more a row: two
///         ends of 38 operations each, one by one, whatever the samples are
/// Error   none
/// Source  [W93] FIGURE 10, backward; running counts as Crow, SIGGRAPH 1984
Transition hough_backward();

}  // namespace edgewise
