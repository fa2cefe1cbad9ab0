#pragma once

#include "charts/scales.hpp"
#include "charts/table.hpp"

namespace edgewise::charts {

/// The axes that all of a table fits on: predicted, measured, budgets and peers. Of a sweep what is
/// drawn: no predictions, and budgets only where they are near.
LogAxis seconds_axis(const Table& table);
LogAxis error_axis(const Table& table);

}  // namespace edgewise::charts
