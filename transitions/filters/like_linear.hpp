#pragma once

#include "graph/request.hpp"

namespace edgewise {

/// Compares with the usual default of other programs: linear interpolation, and the nearest label.
/// Filters that read one sample a place are barred, except for labels.
Like like_linear(Field field);

}  // namespace edgewise
