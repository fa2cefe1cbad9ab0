#pragma once

#include "transitions/filters/filter.hpp"

namespace edgewise {

Filter keys_filter();

}  // namespace edgewise
