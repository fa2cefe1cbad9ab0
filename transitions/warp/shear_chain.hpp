#pragma once

#include <array>
#include <optional>

#include "transitions/kernels/shears.hpp"

namespace edgewise {

/// Splits an equiareal map of index coordinates into a signed permutation and unit shears.
///
/// Where one axis only moves (every image, and every turn about one axis of a volume) the other two
/// get three shears (EQ 32; for a turn EQ 10 after the nearest quarter turn, displacement
/// <= 1.0674). Any other map gets four shears of the axes a, b, c, a: all 24 signed permutations of
/// the right determinant and all 6 orders of the axes are tried. For rotations the nearest
/// permutation whose displacement is at most (3 + sqrt 2) / 4 = 1.1036 voxels is kept, so that
/// shears vanish with the angle; for other maps the least displacement. The translation goes inside
/// the rounding.
///
/// @param t  object space -> screen space, index coordinates [voxel], |det| = 1 within 1e-9
/// @return nothing where no finite chain gives t back within 1e-9; never so for a rotation
/// Source: EQ 10, 22, 31 to 34 and Theorem 3.1; the four shears are the project's own (they need
/// one pass less than EQ 35 merged, whose displacement is larger)
std::optional<kernels::ShearChain> shear_chain(const kernels::Affine& t);

}  // namespace edgewise
