#pragma once

#include "transitions/filters/filter.hpp"

namespace edgewise {

Filter zoh_filter();

}  // namespace edgewise
