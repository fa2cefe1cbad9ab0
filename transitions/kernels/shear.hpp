#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "graph/samples.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/shears.hpp"

namespace edgewise::kernels {

/// One pass of a multipass warp: every line along the shear's axis moves by its own constant shift.
struct ShearPass {
    Shear shear;
    Region from, to;  // boxes of samples before and after; coordinates may be negative
    const Filter* filter = nullptr;  // of Hold::weighted
};

/// The passes of a chain, with the boxes between them: large enough that nothing on the screen is
/// cut off, no larger than what the input, the screen and the filter's support make necessary.
/// Where a box is empty nothing of the input is on the screen.
/// Frames  the first box is the input behind the chain's exact permutation, where a reversed axis
///         runs from -(n-1) to 0; the last lies in the screen
/// @param hold    not zoh
/// @param filter  of Hold::weighted
std::vector<ShearPass> shear_passes(const ShearChain& chain, const Extent& input,
                                    const Extent& screen, Hold hold,
                                    const Filter* filter = nullptr);

/// A shift this close to whole samples is whole.
inline constexpr double kWholeShift = 1e-9;
/// Whether all lines move by the same whole number of samples: a copy, whatever the filter.
inline bool moves_whole(const Shear& shear) noexcept {
    return shear.by == std::array<double, 3>{} &&
           std::abs(shear.offset - round_half_up(shear.offset)) <= kWholeShift;
}

/// The same passes for a box of the screen alone, over no more samples than it is made of. Values
/// of samples that the input reaches (mask_outside) are those that the whole passes give, bit for
/// bit. Beyond the ends of lines that were cut short stand other values, which nothing on the
/// screen is made of.
/// @return nothing where the box does not see the input
std::vector<ShearPass> passes_of_box(std::vector<ShearPass> passes, Hold hold, const Region& box);

/// Floats of scratch that one call of run_shear_pass needs.
std::size_t shear_scratch(const ShearPass& pass) noexcept;

/// Moves the lines of a part of pass.to; the part must hold whole lines.
/// Beyond the ends of a line its last sample continues (clamped position).
/// @param in    one channel; its samples fill pass.from, unless it has steps of its own
///              (Grid::row); its value map is applied
/// @param out   f32 samples of the box `held`, which contains pass.to
/// @param hold  foh: linear; bspline3: cubic B-spline through the samples of each line (prefiltered
///              with the pole sqrt(3) - 2, mirrored at the ends of the line); weighted: by the
///              weights of the pass's filter, beyond the ends of a line its outermost samples
/// Source  [W93] EQ 10 and 3.6.6 (multipass warp); four-shear chains in volumes
void run_shear_pass(const ShearPass& pass, const Grid& in, float* out, const Region& held,
                    Hold hold, const Region& part, float* scratch) noexcept;

/// Writes `outside` wherever the screen sample does not see the input: farther than half a sample
/// beyond the outermost centres, as BackwardWarp decides it.
/// @param out  f32 samples of the box `held` of the screen
void mask_outside(const Affine& to_input, const Extent& input, float outside, float* out,
                  const Region& held, const Region& part) noexcept;

}  // namespace edgewise::kernels
