#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Composites by the trapezoidal rule: the transfer function is taken at both ends of each piece of
/// a ray. A piece's optical depth is the mean of both ends times its length; its colour is the mean
/// of both ends, weighted by their optical depths. Light within a piece is attenuated alike.
///
/// Pieces go from where a ray enters to the middle of its first cell, from there to the next cell's
/// middle, and from the last one to where it leaves. All of a ray's length counts.
/// Edge    object/scalar or object/coefficients -> screen/picture
/// Shape   as project.ray_cast
/// Needs   a mode with a transfer function of the value alone, no light, one memory
/// Work    that of project.ray_cast, a logarithm and an exponential a sample
/// Error   of second order in the step; measured by running it
/// Source  [W93] EQ 62 and 63; Etiene and others, "Verifying volume rendering using discretization
///         error analysis", IEEE TVCG 20(1), 2014
Transition trapezoid_cast();

}  // namespace edgewise
