#pragma once

#include "transitions/kernels/shear_perspective.hpp"
#include "transitions/kernels/visible_runs.hpp"

namespace edgewise::kernels {

/// perspective_slices of over and other, by runs: of each row of a slice only what may be seen is
/// added, and only to pixels that let light through. The states become those of perspective_slices
/// to the bit. Single-threaded, no allocation. [Lacroute, Levoy 1994]
/// @param runs   of visible cells, along the rows of the slices
/// @param first  slice of the runs that is the lowest of these
PerspectiveTile perspective_runs(const PerspectiveSlices& of, const VisibleRuns& runs,
                                 std::int64_t first, std::int64_t i, std::int64_t j,
                                 std::int64_t width, std::int64_t height, float* room);

}  // namespace edgewise::kernels
