#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// The middle of each neighbourhood, the lower of two. NaN is left out of it, and is the result
/// where nothing else is there.
///
/// `filter.median` selects among the samples of every neighbourhood (Hoare 1961).
/// `filter.median_histogram` keeps a histogram along each row, which what enters and what leaves
/// the kernel change (Huang, Yang, Tang, "A fast two-dimensional median filtering algorithm", IEEE
/// ASSP 27(1), 1979). Of samples of one byte, and of kernels of any shape.
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Needs   a median
/// Work    about twelve operations a place; or four for each place on the kernel's left and right
///         ends, and what the middle moves by
/// Error   none
Transition filter_median();
Transition filter_median_histogram();

}  // namespace edgewise
