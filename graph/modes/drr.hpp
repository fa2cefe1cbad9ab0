#pragma once

#include "graph/mode.hpp"

namespace edgewise {

extern const ModeTraits drr_mode;

}  // namespace edgewise
