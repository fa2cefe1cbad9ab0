#pragma once

#include <string>

#include "charts/gnuplot.hpp"

namespace edgewise::charts {

/// The script of a table of a sweep: measured seconds above measured errors, both logarithmic,
/// against the value that was swept; a line a path, what the planner chose in black.
std::string sweep_script(const Table& table, Picture picture);

}  // namespace edgewise::charts
