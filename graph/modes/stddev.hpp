#pragma once

#include "graph/mode.hpp"

namespace edgewise {

extern const ModeTraits stddev_mode;

}  // namespace edgewise
