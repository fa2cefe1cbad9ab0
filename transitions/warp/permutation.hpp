#pragma once

#include "graph/transition.hpp"
#include "transitions/kernels/permutation.hpp"

namespace edgewise {

/// Forward permutation warp: each object sample computes one screen sample and sends it there.
/// Edge    object/scalar -> screen/scalar, 2D or 3D; f32 out, channels interleaved
///         scaled/scalar -> screen/scalar: what a grid of equal spacing leaves of a view that
///         scales
/// Filter  me: the sample itself; zoh, foh: the input reconstructed where T^-1 puts the screen site
/// Needs   equiareal T (EQ 31, EQ 34 with det 1 or -1); otherwise refused with the determinant. A
///         displacement that needs a halo of more than 4 samples is refused too: it would not pay
/// Border  that of warp.backward
/// Work    a sample, foh: 2D 30 operations, 3 L, 1 G (FIGURE 30); 3D with four shears 65 (rule 20,
///         inverse 15, rounding 3, clip 6, 7 interpolations), 7 L, 1 G
/// Error   that of warp.backward with the same hold: both reconstruct once, at the same point. From
///         scaled samples as much less as their grid is finer, for waves of two input samples
/// Source  [W93] 3.6.2 to 3.6.5, EQ 22, FIGURE 28 to 30, TABLE 6, Theorem 3.1
Transition permutation_warp();

/// What its filter makes a sample send.
kernels::Send send_of(const Parameters& with);

}  // namespace edgewise
