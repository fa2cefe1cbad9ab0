#pragma once

#include "graph/mode.hpp"

namespace edgewise {

extern const ModeTraits mip_mode;

}  // namespace edgewise
