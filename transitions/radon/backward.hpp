#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Each line is followed through the samples, from strip to strip: exact integrals of the bilinear
/// field, which ends one sample beyond the outermost centres.
///
/// Edge    object/scalar -> hough/scalar, see radon_edge()
/// Needs   a sinogram
/// Work    for each angle a strip of each sample is crossed max(|cos|, |sin|) times (mean 0.9),
///         through 1.6 cells each time; 30 operations a cell, one by one
/// Error   rounding of the result to f32; sums are in f64
/// Source  Radon 1917; Joseph, IEEE Trans. Med. Imaging 1(3), 1982, here with exact weights
Transition radon_backward();

}  // namespace edgewise
