#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// A spectrum as its Hartley transform: the same numbers, all of them real.
///
/// H(f) = Re F(f) - Im F(f) is the sum over voxels of value cas(2 pi f . voxel), cas t = cos t +
/// sin t, for the phase of all axes at once. Row by row and column by column one gets the product
/// of cas along each axis instead, a plane of which is no projection's transform.
/// Edge    object/spectrum+window... -> object/hartley+window...; spectrum.slice reads both. Only
///         by --via
/// Shape   [pz, py, px / 2 + 12] c64 -> [pz, py, px + 9] f32: 60 bytes a row less
/// Needs   both forms in memory at once
/// Work    1 operation a sample. What it saves in bytes a slice pays in rows: two reads for one
/// Error   none but the slice's sum in f32: both forms give the same pictures to 1e-6
/// Source  Bracewell 1986; [W93] 5.1, EQ 79, 80; Malzbender 1993
Transition spectrum_hartley();

}  // namespace edgewise
