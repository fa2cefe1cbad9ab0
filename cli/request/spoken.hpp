#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "graph/message.hpp"

namespace edgewise::cli {

/// What the library says, in the words of the command: `size=fit` is --size fit.
std::string spoken(const Message& message);
std::vector<std::string> spoken(const std::vector<Message>& messages);

/// The option of a setting: "--max-error".
std::string option_of(std::string_view setting);

}  // namespace edgewise::cli
