#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// A volume from its k-space, where magnetic resonance data begin.
///
/// Edge    object/kspace -> object/scalar, f32
/// Shape   [nz, ny, nx] c64 -> [nz, ny, nx]; frequency 0 is sample n / 2, rounded down, and so is
///         the voxel that phases count from: value(i) = 1 / n sum over k of
///         F(k) exp(2 pi i (k - n / 2) (i - n / 2) / n) along each axis
/// Needs   one channel, whole in memory, finite values
/// part    magnitude, or the real part of samples whose phase is known to be 0
/// Work    5 n log2 n a line of each axis, 10 a voxel
/// Error   rounding of f32
/// Source  [W93] 5.2
Transition spectrum_from_kspace();

}  // namespace edgewise
