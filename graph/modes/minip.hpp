#pragma once

#include "graph/mode.hpp"

namespace edgewise {

extern const ModeTraits minip_mode;

}  // namespace edgewise
