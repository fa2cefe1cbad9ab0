#pragma once

#include <string>

namespace edgewise::cli {

/// The file of a program that is found on PATH, or "".
std::string program_on_path(const std::string& name);
/// The same. @throws RunError it is not installed, naming the Debian package
std::string installed_program(const std::string& name, const std::string& package);

/// See Query::film_encoder.
std::string film_encoder();

}  // namespace edgewise::cli
