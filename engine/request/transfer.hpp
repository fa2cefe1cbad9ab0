#pragma once

#include <string>

#include "engine/request/spec.hpp"

namespace edgewise {

/// Reads a transfer function (docs/files.md). @throws RequestError naming the file and the field
TransferSpec load_transfer(const std::string& file);

}  // namespace edgewise
