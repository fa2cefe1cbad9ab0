#pragma once

#include <string>

#include "charts/gnuplot.hpp"

namespace edgewise::charts {

/// Text as gnuplot takes it between ' and '.
std::string quoted(const std::string& text);
/// Text as gnuplot takes it in data, between " and ".
std::string double_quoted(const std::string& text);
/// At most so many characters (not bytes); what is cut out of its middle becomes "…".
std::string shortened(const std::string& text, std::size_t most);
/// The first lines of a script: terminal, fonts, a light grid.
std::string head_of(Picture picture, int width, int height);

}  // namespace edgewise::charts
