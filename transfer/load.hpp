#pragma once

#include <string>

#include "transfer/transfer_spec.hpp"

namespace edgewise {

/// Reads a transfer function of any format that docs/files.md describes: its own, a ParaView
/// preset, a volume property of Slicer, a volume preset of vtk.js. What the file holds says which
/// it is.
/// @param file    of several presets with the name of one behind: "FILE#NAME"
/// @param field  of the query, that messages name
/// @throws RequestError naming the file and the field
TransferSpec load_transfer(const std::string& file, SettingName field = "transfer");

}  // namespace edgewise
