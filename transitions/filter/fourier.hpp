#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Sums as products of spectra, tile by tile (overlap-save). The work hardly depends on the size
/// of the kernel.
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Needs   a sum; samples that are finite: an infinity would fill its tile
/// Work    two real transforms a tile and one product a frequency
/// Error   rounding of transforms in f32: 2^-24 log2(values of a tile) times the sum of the
///         magnitudes of the weights and the largest value, at most. Sums of integers with whole
///         weights are rounded to integers, and served only where that is exact
/// Source  [W93] 2.3; Stockham 1966
Transition filter_fourier();

}  // namespace edgewise
