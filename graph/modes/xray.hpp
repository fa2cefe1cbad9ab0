#pragma once

#include "graph/mode.hpp"

namespace edgewise {

extern const ModeTraits xray_mode;

}  // namespace edgewise
