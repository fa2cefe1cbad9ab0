#pragma once

#include <string>

namespace edgewise::cli {

/// The words that say what somebody meant by an option that `filter` does not have, as `--gaussian
/// 2`: "--op convolve --kernel gauss:2"; or "".
/// @param value  what follows the option, if anything does
std::string meant_by_filter_option(const std::string& option, const std::string& value);

}  // namespace edgewise::cli
