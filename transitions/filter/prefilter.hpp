#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// The spline prefilter: samples to the coefficients of the cubic B-spline through them.
/// Edge    object/scalar -> object/coefficients; any type in, mapped values in f32 out
/// Shape   that of the input; channels stay interleaved, each filtered alone
/// Needs   finite samples: the recursion carries one that is not along its whole row, column and
///         slice. Labels are refused: nobody reads between them
/// Work    5 operations a sample and axis (causal M + A, anticausal 2 M + A); the first axis
/// streams
///         the samples once, each other twice
/// Error   that of f32; an error of coefficients counts as that of the samples they stand for
/// Source  M. Unser, "Splines: a perfect fit for signal and image processing", IEEE Signal
/// Processing
///         Magazine 16(6), 1999
Transition spline_prefilter_edge();

}  // namespace edgewise
