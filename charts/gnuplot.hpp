#pragma once

#include <string>

#include "charts/table.hpp"

namespace edgewise::charts {

enum class Picture { svg, png };

/// A gnuplot script, data included, that writes a chart to standard output: time against error,
/// both logarithmic, a mark a path (measured: full, predicted: hollow, joined by a line), the front
/// as steps and numbered, with its paths written out below, budgets, peers. An error of 0 is drawn
/// at the foot of its axis. Of a sweep: time and error against what is swept, a line a path.
std::string gnuplot_script(const Table& table, Picture picture);

/// What gnuplot makes of it. The bytes of an SVG hang on the table alone.
/// @param gnuplot  the program's file
/// @throws std::runtime_error it does not start, or fails
std::string drawn(const Table& table, Picture picture, const std::string& gnuplot);

}  // namespace edgewise::charts
