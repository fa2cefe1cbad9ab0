#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Scales by the spectrum: n samples of an axis become m of the same period. Frequencies that m
/// cannot hold are left out; where m is larger, none are added. Shifts are phases.
///
/// Edge    object/scalar -> screen/scalar, 2D or 3D, one channel; f32 out; on demand
/// Needs   a map that scales and shifts each axis alone, with a whole number m of output samples in
///         the n of the input; finite samples; no labels
/// Field   that of warp.phase_shift; where m < n, what is left of it
/// Border  that of warp.backward
/// Work    a real transform of n and one of m a line, 2.5 n log2 n each, and 14 a frequency, one by
///         one
/// Error   not known of the field that is asked for; --verify measures it
/// Source  Yaroslavsky 1997
Transition spectrum_resample();

}  // namespace edgewise
