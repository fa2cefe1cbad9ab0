#pragma once

#include "graph/mode.hpp"

namespace edgewise {

extern const ModeTraits mean_mode;

}  // namespace edgewise
