#pragma once

#include "graph/request.hpp"

namespace edgewise {

/// What every other program gives: linear interpolation; of labels the nearest one. Barred is what
/// reads one sample a place, unless it is labels.
Like like_linear(Field field);

}  // namespace edgewise
