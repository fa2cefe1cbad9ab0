#pragma once

#include <functional>

#include "graph/front_watch.hpp"
#include "graph/transition.hpp"
#include "transitions/project/counts.hpp"

namespace edgewise {

/// Depths of the pictures that are made on the way, in ascending order; the last is `depth`.
/// Empty: the last picture alone, tile by tile.
using FrontDepths = std::function<std::vector<std::int64_t>(const Parameters&, std::int64_t depth)>;

/// An edge that composites classified samples in one of the orders of [W93] Appendix B. Name,
/// source and parameters are for the caller to set.
/// Edge    screen/classified -> screen/picture, on demand
/// Shape   [nz, ny, nx, 4] in; [ny, nx, 4] out: premultiplied red, green, blue, opacity
/// Work    a pixel: counts_of() of three colours but EQ 83 and 88, which the classified samples
///         have, and opacity_counts() for the fourth channel; 16 bytes read a sample
/// Error   that of project.combine, and the rounding of as many composites as lie on one another
Transition over_edge(Compositing how, FrontDepths depths = {}, FrontWatch watch = {});

/// Why no picture can be composited of a vertex; empty: it can.
std::string no_compositing(const Representation& from, const Ask& ask);

}  // namespace edgewise
