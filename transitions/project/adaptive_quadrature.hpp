#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Compositing by pieces of rays that are as long as a bound of their error allows: no channel of a
/// pixel (of 0 to 1) is off by more than a tolerance.
///
/// The integral is that of the trilinear field, whose own error is not bounded. With the optical
/// depth s = -log(1 - opacity) a unit, colour c and transparency T it is that of T s c along the
/// ray. Replace exact pieces by others, from the front: each time a pixel changes by what the piece
/// errs times the T that the picture has before it, for light behind is between 0 and 1. Pieces are
/// taken while the sum of these is within the tolerance: one may have as much of what is left as it
/// has of the length that is left, or 1/256. A ray ends where no more is left to see than that.
///  - A node of 4^3, 16^3 or 64^3 cells whose samples lie in a range is one piece, without a sample
///    of the field. Opacity lies in [a0, a1] and colour within d: in the middle it errs by at most
///    (a1 - a0 + a1 d) / 2. Nodes of one value are exact.
///  - In a cell the value is a cubic v(x) along the ray, cut where it meets a knot of the transfer
///    function, and halved from there on. With x from -1 to 1 in a piece of length 2 h, opacity and
///    colour are linear in v(x) - v(0), and the transparency of a unit is Q (1 - y(x)). Let R > 1
///    be so that |y| <= 0.8 within |x| <= R, and g = 64/15 / (rho^4 (rho^2 - 1)) with rho = R +
///    sqrt(R^2 - 1). Gauss's rule of three points errs by at most g times the largest integrand
///    there. So the depth is off by at most e = h g log(5) / unit.
///  - Colour is that of the middle, and the first moment of its change. The moment is weighted by
///    s(x) (1 - s(0) h x) times the root of the piece's transparency, by the same rule. What that
///    leaves out of T is at most e^u (z^2 / 2 + e^(2u) - 1), with z = s(0) h, and u = h times what
///    s differs from s(0).
///  - Where a piece is steep (R <= 2), the range of v bounds as a node's does.
/// Only an estimate:
///  - pieces no longer than `least` are taken whatever their bound: beside opacities of 1, and in
///    ramps that are as steep;
///  - beside samples that are not finite the field is a quotient, for which cubics stand that have
///    its values at four places;
///  - opacities of 1 at one value alone count as 1 - 2^-24; and f64 rounds.
/// Edge    object/scalar -> screen/picture; only by --via
/// Shape   [nz, ny, nx], x fastest, any real type; four f32 a pixel
/// Needs   a mode that composites, without light; one memory
/// Work    ranges of all nodes; a ray at a time, without vectors: some 300 operations a cell that
///         is not empty
/// Error   `tolerance` of the integral; that of the field is measured by runs
/// Source  Novins and Arvo, "Controlled precision volume integration", 1992 Workshop on Volume
///         Visualization; Trefethen, Approximation Theory and Approximation Practice, 2013,
///         theorem 19.3
Transition adaptive_quadrature();

}  // namespace edgewise
