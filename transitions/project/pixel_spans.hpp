#pragma once

#include <cstddef>

#include "graph/request.hpp"
#include "transitions/kernels/ray_cast.hpp"

namespace edgewise {

/// Operations to find where one ray enters and leaves the input.
inline constexpr double kSpanOperations = 60;

/// Parallel rays of a view through all of the input; t is screen z.
kernels::RayCast rays_through_input(const Request& want, int view);

/// Where the rays of a tile are inside the input, see CombinedSpan and kernels::PixelSpans. A ray
/// that misses has low 1 and high 0.
/// @param low, high  [rows][pitch] floats, of the tile's pixels
void fill_spans(const kernels::RayCast& rays, const Region& tile, std::ptrdiff_t pitch, float* low,
                float* high);

}  // namespace edgewise
