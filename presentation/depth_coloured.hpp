#pragma once

#include "graph/request.hpp"
#include "presentation/colormap.hpp"
#include "request/tail.hpp"

namespace edgewise {

/// A MIP whose colours say how deep its values lie: the first colour in front, the last behind, and
/// as bright as the value is between black and white. The depth is that of the first largest value
/// along a pixel's ray, at samples one unit of screen space apart.
/// @param samples  of the input, in memory
/// @param depth    of the scene, from screen z -1/2 on [screen space]
/// @return three channels of 8 bits
Array depth_coloured(const Data& result, const Tail& tail, const Shades& levels,
                     const Colormap& map, const Request& want, const Data& samples, int view,
                     double depth, std::pmr::memory_resource* memory);

}  // namespace edgewise
