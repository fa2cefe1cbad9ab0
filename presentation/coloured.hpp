#pragma once

#include "presentation/colormap.hpp"
#include "request/tail.hpp"

namespace edgewise {

/// A picture of one channel in the colours of a map: black is its first, white its last.
/// @return three channels of 8 bits
Array coloured(const Data& result, const Tail& tail, const Shades& levels, const Colormap& map,
               std::pmr::memory_resource* memory);

}  // namespace edgewise
