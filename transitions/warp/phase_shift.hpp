#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Shifts by parts of a sample: each frequency turns by the phase that the shift is of its wave.
///
/// Edge    object/scalar -> screen/scalar, 2D or 3D, one channel; f32 out; on demand
/// Needs   a map that shifts alone; finite samples; no labels
/// Field   the trigonometric polynomial through the samples, which repeats beyond the input. No
///         filter is it: at faces it rings where opposite ones differ
/// Border  that of warp.backward: what lies beyond half a sample is the value outside
/// Work    two real transforms of each line of an axis that moves, 5 n log2 n, and 14 a frequency,
///         one by one
/// Error   not known of the field that is asked for; --verify measures it
/// Source  the shift theorem; Yaroslavsky 1997
Transition phase_shift();

}  // namespace edgewise
