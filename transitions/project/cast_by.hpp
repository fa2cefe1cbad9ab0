#pragma once

#include <functional>

#include "graph/transition.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/tap_polynomials.hpp"

namespace edgewise {

/// How the tiles of a picture are cast, by edges that differ from project.ray_cast in that alone.
struct CastBy {
    /// As kernels::ray_cast().
    std::function<void(const kernels::RayCast&, std::int64_t x, std::int64_t y, std::int64_t width,
                       std::int64_t height, float* out, std::ptrdiff_t row_floats)>
        tile = {};
    /// Casts a region of the picture, in place of its tiles.
    std::function<void(const kernels::RayCast&)> region = {};
    /// How far the values that it makes may lie beyond samples, given that of the filter; absent:
    /// as far. What bricks leave out hangs on it.
    std::function<kernels::Overshoot(const kernels::Overshoot&)> beyond = {};
};

/// Runs project.ray_cast by it.
void cast_by(const CastBy& by, const Offer& offer, const Ask& ask, const Data& in, Data& out,
             const Region& region, Context& context);

/// How many samples rays take of a view: what is empty or hidden is left out, as counted on the
/// preview.
double samples_taken(const Offer& offer, const Ask& ask, int view);

}  // namespace edgewise
