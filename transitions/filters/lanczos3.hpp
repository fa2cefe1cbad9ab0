#pragma once

#include "transitions/filters/filter.hpp"

namespace edgewise {

Filter lanczos3_filter();

}  // namespace edgewise
