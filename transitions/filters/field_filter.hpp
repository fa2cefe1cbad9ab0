#pragma once

#include "graph/request.hpp"
#include "transitions/filters/filter.hpp"

namespace edgewise {

/// The filter that gives a field that a request asks for: of labels the nearest sample, of a linear
/// field two samples, else the spline through the samples, which is the best guess of a formula.
const Filter& field_filter(Field field);

}  // namespace edgewise
