#pragma once

#include "transitions/filters/filter.hpp"

namespace edgewise {

Filter bspline3_filter();

}  // namespace edgewise
