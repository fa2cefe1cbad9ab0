#pragma once

#include <vector>

#include "graph/request.hpp"

namespace edgewise {

/// Lines of the input along which a multipass warp (warp.shear) interpolates after its first pass,
/// one for each pass of each view that is looked at (at most eight): the direction from one of the
/// pass's samples to the next [input index]. Sheared grids fold over detail that such a slanted
/// line is too coarse for. Lines along an axis of the input, and those too coarse to be worth
/// measuring (the edge refuses them), are left out; views without a chain of shears have none.
std::vector<Vec3> shear_lines(const Request& want);

}  // namespace edgewise
