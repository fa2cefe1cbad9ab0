#pragma once

#include <string>
#include <vector>

#include "transfer/transfer_spec.hpp"

namespace edgewise {

/// Names of the transfer functions that come with the library (transfer/presets/NAME.json).
std::vector<std::string> preset_names();

/// One of them, its name in any case. @throws RequestError naming the nearest
TransferSpec preset_named(const std::string& name);

/// What one of them is for, in one line.
std::string preset_help(const std::string& name);

/// A preset by its name, or the file of that name. @throws RequestError
TransferSpec preset_or_file(const std::string& word);

}  // namespace edgewise
