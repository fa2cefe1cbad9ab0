#pragma once

#include <string>

#include "graph/cost.hpp"

namespace edgewise::cli {

/// "12.3 us", "4.56 ms", "1.234 s".
std::string seconds_text(double seconds);
/// "12.3 MiB".
std::string bytes_text(double bytes);
/// "0.0123 (38.2 dB)", "unknown".
std::string error_text(const Predicted& predicted);

}  // namespace edgewise::cli
