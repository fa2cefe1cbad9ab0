#pragma once

#include "transitions/kernels/shear_warp.hpp"

namespace edgewise::kernels {

/// shear_warp for the largest sample of 8- and 16-bit integers: a sample may count twice and none
/// is special, so rays keep their best in registers over several slices. Of u8 and i8, first-order
/// hold is computed in 1/128 of a level: at most 3/128 of a level is lost.
/// @return false, with nothing done, for other rules and types
bool shear_warp_max(const ShearWarp& warp, std::int64_t i, std::int64_t j, std::int64_t width,
                    std::int64_t height, const PixelSpans& spans, const PixelStates& states);

}  // namespace edgewise::kernels
