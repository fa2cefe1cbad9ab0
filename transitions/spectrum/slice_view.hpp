#pragma once

#include <string_view>

#include "graph/request.hpp"
#include "transitions/kernels/spectrum_slice.hpp"

namespace edgewise {

/// How a slice is taken for a view of a request, as spectrum.slice does.
/// @param to_screen  from the origin voxel of the spectrum on
/// @param slice      extent of the slice
/// @param band       "volume" or "picture"
kernels::SliceView slice_view(const Mat4& to_screen, const Extent& slice, const Request& want,
                              std::string_view band);

}  // namespace edgewise
