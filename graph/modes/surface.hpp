#pragma once

#include "graph/mode.hpp"

namespace edgewise {

extern const ModeTraits surface_mode;

}  // namespace edgewise
