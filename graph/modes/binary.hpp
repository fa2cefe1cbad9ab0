#pragma once

#include "graph/mode.hpp"

namespace edgewise {

extern const ModeTraits binary_mode;

}  // namespace edgewise
