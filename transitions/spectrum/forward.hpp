#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// The Fourier transform of a volume, made once for all views.
///
/// Edge    object/scalar -> object/spectrum+window..., 3D; c64, half of it
/// Shape   [nz, ny, nx] -> [pz, py, px / 2 + 12], p >= padding n with prime factors up to 7
/// Needs   X-ray or mean, parallel rays, finite values, one channel
/// Values  the field is the stored one + values.offset: the commonest value is taken away first, so
///         that a large constant costs no digits and an empty margin does not ring
/// Work    4 a voxel, 5/2 n log2 n a row, 5 n log2 n a column and line that is not empty
/// Error   ghosts of the window (width, padding); rounding of f32
/// Source  [M93]; window: Jackson et al. 1991, Beatty et al. 2005
Transition spectrum_forward();

}  // namespace edgewise
