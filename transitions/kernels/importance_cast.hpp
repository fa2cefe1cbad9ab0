#pragma once

#include <cstdint>

#include "transitions/kernels/ray_cast.hpp"

namespace edgewise::kernels {

/// Compositing by steps that grow as the transparency of a ray falls. A sample stands for m =
/// floor(sqrt(4 loss / T)) whole cells, at least one, and lies in their middle; T is what was left
/// before the sample before. So of what is left now m^2 times is at most the larger of 1 and 4
/// loss: no sample may err by more than the first ones.
///
/// Each ray goes by itself, whoever its neighbours in the packet are. Bricks leave out stretches
/// without opacity; pieces begin anew behind them.
/// @param cast   Hold::foh or Hold::bspline3; Combine::over, without light, edges, cue, integrals.
///               Of `taken` it counts the samples of rays, those at the ends too
/// @param loss   0: all steps are equal, and so is the picture to that of ray_cast()
/// All else as ray_cast().
void importance_cast(const RayCast& cast, double loss, std::int64_t x, std::int64_t y,
                     std::int64_t width, std::int64_t height, float* out,
                     std::ptrdiff_t row_floats);

}  // namespace edgewise::kernels
