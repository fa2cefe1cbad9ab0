#pragma once

#include <string>

#include "engine/transfer/transfer_spec.hpp"

namespace edgewise {

/// Reads a transfer function of any format that docs/files.md describes: its own, a ParaView
/// preset, a volume property of Slicer. What the file holds says which it is.
/// @param option  what messages call it
/// @throws RequestError naming the file and the field
TransferSpec load_transfer(const std::string& file, const std::string& option = "--transfer");

}  // namespace edgewise
