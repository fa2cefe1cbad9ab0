#pragma once

#include <vector>

#include "charts/table.hpp"

namespace edgewise::charts {

/// Marks the Pareto front of measured seconds and measured error: a point is on it where both are
/// known and no other point with the same `at` is at least as good in both and better in one. So
/// equals are on it together.
void mark_front(std::vector<Point>& points);

/// Places of the points on the front, fastest first.
std::vector<std::size_t> front_of(const std::vector<Point>& points);

}  // namespace edgewise::charts
