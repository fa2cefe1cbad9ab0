#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Pre-integration of second order: composites whose transfer function is integrated between
/// samples, along a value that is a quadratic through both ends and the middle of each piece.
///
/// The function's integrals are those of a table (kernels/transfer_sums.hpp), along two chords of
/// each half of a quadratic, extrapolated from one. Light within a piece is attenuated by what of
/// it lies before: colours go evenly with the optical depth. Where value and function are smooth
/// the error is of fourth order in the step; of project.preintegrated_cast and of the midpoint rule
/// it is of second. At kinks (of a trilinear field, or of the function) it is of second order too.
/// Edge    object/scalar or object/coefficients -> screen/picture
/// Shape   as project.ray_cast
/// Needs   a mode with a transfer function of the value alone, no light, one memory
/// Work    that of project.ray_cast with twice the samples; of each piece 40 gathers, two
///         exponentials and some 600 operations; a table a view
/// Error   measured by running it
/// Source  El Hajjar, Marchesin, Dischler, Mongenet, "Second order pre-integrated volume
///         rendering", PacificVis 2008; here with sums in one variable in place of their tables
Transition preintegrated_quadratic_cast();

}  // namespace edgewise
