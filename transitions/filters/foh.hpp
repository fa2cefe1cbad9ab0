#pragma once

#include "transitions/filters/filter.hpp"

namespace edgewise {

Filter foh_filter();

}  // namespace edgewise
