#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "graph/message.hpp"

namespace edgewise {

/// Text between separators; an empty text is one empty word.
std::vector<std::string> split(std::string_view text, char separator);

/// A finite number. @param name what the message calls it: setting("rotate")
/// @throws RequestError naming `name`, the text and what was expected
double number_of(const Message& name, std::string_view text);

/// Finite numbers between commas. @throws RequestError
std::vector<double> numbers_of(const Message& name, std::string_view text);

/// A whole number between two ends, both included. @throws OutOfLimits
std::int64_t whole_of(const Message& name, std::string_view text, std::int64_t low,
                      std::int64_t high);

}  // namespace edgewise
