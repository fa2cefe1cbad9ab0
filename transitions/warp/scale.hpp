#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// The space of samples of equal spacing.
inline constexpr const char* kScaled = "scaled";

/// Resamples along the axes to a grid of equal spacing, so that what is left of a view is
/// equiareal: maps that move samples one to one (warp.permutation) exist for no other.
/// Edge    object/scalar or object/coefficients -> scaled/scalar, volumes of pictures; f32 out
/// Filter  as warp.backward has them; each axis by itself, only where it needs any
/// Grid    about the middle of the input, spacing cbrt(s_x s_y s_z / |det|), det of the residual;
///         as many samples as cover the input, whose outermost samples continue
/// Needs   samples that are not equally spaced, views whose |det| is the same and not 1, and no
///         axis along which the grid is coarser than the samples, which would skip some; neither
///         clip nor light, which no edge behind it takes
/// Work    a slice of the grid: `taps` products and sums a sample along z, then y, then x; along
///         an axis that keeps its samples one product
/// Error   that of reading by the filter (as warp.backward), though along some axes nothing is read
///         between samples. What reads the grid next adds its own: two linear holds blur twice
/// Source  [W93] 3.7, FIGURE 36: scalings have no one-to-one assignment and go before one
Transition scaling();

}  // namespace edgewise
