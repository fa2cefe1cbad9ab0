#pragma once

#include "graph/mode.hpp"

namespace edgewise {

extern const ModeTraits composite_mode;

}  // namespace edgewise
