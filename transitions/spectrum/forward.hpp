#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// The Fourier transform of a volume, made once for all views.
///
/// Edge    object/scalar -> object/spectrum+window..., 3D; c64, half of it
/// Shape   [nz, ny, nx] -> [pz, py, px / 2 + 12], p >= padding n with prime factors up to 7
/// Needs   X-ray, mean or radiograph, parallel rays, finite values, one channel; of a radiograph no
///         values below air, which it cuts off
/// Values  the field is the stored one + values.offset: the commonest value is taken away first, so
///         that a large constant costs no digits and an empty margin does not ring
/// Work    4 a voxel, 5/2 n log2 n a row, 5 n log2 n a column and line that is not empty
/// Error   ghosts of the window (width, padding) and rounding of f32: measured by a preview for the
///         windows that are tried and those that are asked for, else what scans gave. Of a
///         radiograph p an error d of the exponent is p (exp(d) - 1) at most
/// Source  [M93]; window: Jackson et al. 1991, Beatty et al. 2005
Transition spectrum_forward();

/// The same by a window that keeps a small error, where one is asked for.
///
/// Edge    as spectrum.forward
/// Needs   a budget of errors that a preview tells no window of spectrum.forward to keep, although
///         what pictures by any window get wrong would leave room for it. Of the windows whose
///         bound of ghosts fits, the one of fewest operations over all views is offered; the others
///         are refused
/// Work    as spectrum.forward
/// Error   the bound of the window's ghosts along three axes, of rays up to the picture's range:
///         no preview measures it
Transition spectrum_wide();

}  // namespace edgewise
