#pragma once

#include <string>

#include "charts/table.hpp"

namespace edgewise::charts {

/// The points as comma-separated values (RFC 4180, but with plain line ends), with a line of names:
/// plan,predicted_seconds,measured_seconds,predicted_error,measured_error,predicted_bytes,
/// measured_bytes,front. What is not known is empty; front is 1 or 0. A sweep has its option as one
/// column more, the last.
std::string to_csv(const Table& table);

}  // namespace edgewise::charts
