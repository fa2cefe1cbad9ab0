#pragma once

#include <string>
#include <vector>

namespace edgewise::charts {

/// Whether a program is found on PATH.
bool has_program(const std::string& name);

/// Runs a program of the PATH with text on its standard input. @return its standard output
/// @throws std::runtime_error it is not installed (naming the Debian package), or fails, with what
///         it said
std::string output_of(const std::vector<std::string>& words, const std::string& input,
                      const std::string& package);

}  // namespace edgewise::charts
