#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// The plane through the origin of a spectrum that belongs to a view (slice theorem).
///
/// Edge    object/spectrum+window... -> slice/spectrum, one a view; the same of object/hartley
/// Shape   [py, px / 2 + 1] c64, p the period of the picture: so large that the volume's
/// repetitions
///         stay outside
/// Work    width^3 complex taps a sample of the slice; of a Hartley transform as many operations,
///         but twice the rows, each half as long, at f and at -f
/// Error   band=volume: what the field has beyond 3/4 cycle a voxel. band=picture: what it has
///         beyond the picture's own band, which sampling at pixel centres would fold back; unknown,
///         so that no budget is promised
/// Source  Bracewell 1956; [M93]; [W93] 5.1
Transition spectrum_slice();

}  // namespace edgewise
