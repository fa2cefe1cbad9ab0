#pragma once

#include <array>
#include <string>

#include "graph/transition.hpp"
#include "transitions/kernels/splat_ewa.hpp"

namespace edgewise {

// What edges that splat elliptical Gaussians share. Their parameters are `sigma` and `lowpass`.

/// One view, without samples. Where rays are parallel the eye is 1 before everything.
kernels::EwaSplat ewa_view_of(const Representation& from, const Request& want, int view,
                              const Parameters& with);

/// Why an eye is too near to the samples, or "".
std::string no_ewa_distance(const Representation& from, const Request& want, int view);

/// What a voxel in the middle has of the screen: of a unit variance along all axes of index space
/// the variance along both sides [pixel^2 / voxel^2].
std::array<double, 2> ewa_spread_of(const kernels::EwaSplat& splat, const Extent& n);

}  // namespace edgewise
