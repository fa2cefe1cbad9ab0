#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "transfer/transfer_spec.hpp"

namespace edgewise::transfer {

// One reader a format. `where` is what messages begin with: a setting and its file.

/// @throws RequestError where it is no JSON, or nested too deeply
nlohmann::json parsed(std::string_view text, const std::string& where);

/// The format of docs/files.md. @throws RequestError
TransferSpec own_transfer(const nlohmann::json& json, const std::string& where);

bool is_paraview(const nlohmann::json& json);
/// A preset that ParaView exported. @throws RequestError
TransferSpec paraview_transfer(const nlohmann::json& json, const std::string& where);

bool is_slicer(const nlohmann::json& json);
/// A volume property of Slicer: .vp.json. @throws RequestError
TransferSpec slicer_transfer(const nlohmann::json& json, const std::string& where);

bool is_vtkjs(const nlohmann::json& json);
/// A volume preset of vtk.js, cornerstone or OHIF. @throws RequestError
TransferSpec vtkjs_transfer(const nlohmann::json& json, const std::string& where);

/// The older volume property of Slicer, nine lines of text: .vp. @throws RequestError
bool is_slicer_text(std::string_view text);
TransferSpec slicer_text_transfer(std::string_view text, const std::string& where);

}  // namespace edgewise::transfer
