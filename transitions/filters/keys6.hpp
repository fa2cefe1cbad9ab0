#pragma once

#include "transitions/filters/filter.hpp"

namespace edgewise {

Filter keys6_filter();

}  // namespace edgewise
