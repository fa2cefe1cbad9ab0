#pragma once

#include <string>
#include <vector>

namespace edgewise::charts {

/// Runs a program with text on its standard input. @return its standard output
/// @param words  its file and its arguments, as they are: no shell reads them
/// @throws std::runtime_error it does not start, or fails, with what it said
std::string output_of(const std::vector<std::string>& words, const std::string& input);

}  // namespace edgewise::charts
