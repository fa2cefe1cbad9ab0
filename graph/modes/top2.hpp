#pragma once

#include "graph/mode.hpp"

namespace edgewise {

extern const ModeTraits top2_mode;

}  // namespace edgewise
