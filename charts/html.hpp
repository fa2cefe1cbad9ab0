#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace edgewise::charts {

/// Text as it may stand between tags, and in attributes between ".
std::string html_text(const std::string& text);

/// JSON as it may stand in a script element, which the first "</script" would end. In JSON "<" is
/// found in texts only.
std::string script_text(const nlohmann::ordered_json& json);

/// Puts texts in the places that {{name}} marks; what is put in is not looked at again.
/// @throws std::out_of_range a name that has no text
std::string filled(std::string_view form, const std::map<std::string, std::string>& texts);

}  // namespace edgewise::charts
