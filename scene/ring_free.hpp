#pragma once

#include "graph/data.hpp"
#include "graph/request.hpp"

namespace edgewise {

// Casts sample the field along rays at even steps. Where opacity rises within few samples, what a
// pixel shows depends on where the first of them lies. From pixel to pixel that changes slowly, so
// that shaded pictures have rings like those of wood. A mean over a picture does not see them,
// people do.

/// By so much colours may differ by where samples lie, of 255 levels.
constexpr double kRingLevels = 8;

/// How steep the field is where a transfer function shows something: a thousandth of the
/// differences between neighbouring samples is larger, of which one is opaque and one is not
/// opaque in full. Of some 100,000 drawn pairs. 0: nothing is seen.
/// @return  [value per smallest spacing]
double seen_slope(const Data& data, const Request& want);

/// The longest step without rings, of 1, 1/2, 1/4 and 1/8 of the smallest spacing.
///
/// A rule; no picture is drawn. A ray enters a body whose values rise evenly from the least to the
/// greatest, at `slope` or at 1/2, 1/4, 1/8 of it, and stays inside. Its samples begin at eight
/// places within a step. The step is one where what composites of these differ by is at most
/// kRingLevels. Lit pictures take two samples a spacing or more, since the light of a trilinear
/// field turns from sample to sample, and four where edges are narrower than four spacings. So do
/// surfaces: their edges are rays that graze them. Opacities by a table of gradients take two.
/// Other pictures take any step: 1.
/// @param low, high  of the data [value]
/// @param slope      [value per smallest spacing]
double ring_free_step(const Request& want, double low, double high, double slope);

}  // namespace edgewise
