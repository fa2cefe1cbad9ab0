#pragma once

#include <cstdint>

#include "graph/transition.hpp"
#include "transitions/kernels/kaiser_bessel.hpp"

namespace edgewise {

/// The spectrum resampled once onto half-planes through the axis of a turntable, so that a view of
/// it is an interpolation along the angle alone.
///
/// Edge    object/spectrum+window... -> object/polar+..., c64
/// Shape   [planes, py, px / 2 + 1]: half a turn of slices of the picture's period; the other half
///         are their mirror images
/// Needs   views that turn about the screen's y through the volume's middle, which is a pixel or
///         half-way between two; otherwise what spectrum.slice needs
/// angle   linear: between two planes. window: planes are divided beforehand, wave by wave of the
///         turn, by the transform of a window of 6 planes
/// planes  in half a turn. 0: linear: the least number that all views lie on; window: as many as
///         the volume's radius needs, 3 pi / 4 x 1.25 x 2 of it
/// Work    that of spectrum.slice once a plane; of a window 10 n log2 n a sample of half a slice,
///         n the planes of a turn
/// Error   none where all views lie on planes (linear); of a window with as many planes as needed
///         the window's mean ghost; else unknown. Left out: what comes and goes between
///         planes at the cutoff, up to a hundredth in volumes of a few samples
/// Source  [W93] 5.2, FIGURE 87; Jackson et al. 1991
Transition spectrum_polar();

/// A view's slice from the planes beside its angle.
///
/// Edge    object/polar+... -> slice/spectrum, one a view
/// Work    1, 2 or 6 planes are read in order: 4 operations a sample and plane
/// Error   none of its own
Transition spectrum_polar_slice();

/// Taps and padding of the window along the angle.
const kernels::KaiserBessel& angle_window();

}  // namespace edgewise
