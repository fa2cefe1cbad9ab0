#pragma once

#include "graph/samples.hpp"

namespace edgewise::kernels {

/// Samples to the coefficients of the cubic B-spline that runs through them, in place.
/// Shape   x fastest, channels interleaved; axes of one sample are left as they are
/// Border  whole-sample mirror (... 2 1 | 0 1 2 ...), summed exactly for short axes
/// Method  one causal and one anticausal recursion an axis, pole sqrt(3) - 2, gain 6; f32, within
///         3e-6 of the samples' range of f64 (white noise, whose coefficients reach ten times it)
/// Threads all of the caller's arena; the result does not depend on their number
/// Source  M. Unser, "Splines: a perfect fit for signal and image processing", IEEE Signal
/// Processing
///         Magazine 16(6), 1999, boxes 1 and 2
void spline_prefilter(float* samples, const Extent& extent, int channels = 1);

}  // namespace edgewise::kernels
