#pragma once

#include "transitions/kernels/shear_warp.hpp"
#include "transitions/kernels/visible_runs.hpp"

namespace edgewise::kernels {

/// A tile is at most so large: pixels of a row that are not opaque yet are bits of one word.
inline constexpr std::int64_t kRunsWidth = 128, kRunsHeight = 16;

/// shear_warp of over and other, by runs: of each row of a slice only what may be seen is added,
/// and only to pixels that let light through. Where a row of the image has such pixels is kept
/// beside it, and found without a look at pixels (what the links of opaque runs are for in
/// [Lacroute, Levoy 1994]). The states become those of shear_warp to the bit. Single-threaded, no
/// allocation.
/// @param runs    of visible cells, of the same volume and rule
/// @param states  all of them are cleared, also those of a row behind `width`
void shear_warp_runs(const ShearWarp& warp, const VisibleRuns& runs, std::int64_t i, std::int64_t j,
                     std::int64_t width, std::int64_t height, const PixelSpans& spans,
                     const PixelStates& states);

}  // namespace edgewise::kernels
