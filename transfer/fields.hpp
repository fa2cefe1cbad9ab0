#pragma once

#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace edgewise::transfer {

/// @param where  setting and file, as a Message keeps them: transfer=bone.json
/// @throws RequestError
[[noreturn]] void refuse(const std::string& where, const std::string& what);

/// @throws RequestError naming the field
double number_in(const nlohmann::json& value, const std::string& where, const std::string& field,
                 double low, double high);

/// A member of an object. @throws RequestError naming it and the object
const nlohmann::json& member_of(const nlohmann::json& json, const char* key,
                                const std::string& where, const std::string& field,
                                const std::string& example);

/// A mistyped key would be left out without a word.
void expect_known(const nlohmann::json& json, const std::string& where, const std::string& within,
                  std::vector<std::string> keys);

/// Red, green and blue. @throws RequestError naming the field
std::array<double, 3> color_in(const nlohmann::json& value, const std::string& where,
                               const std::string& field);

/// Some text of a file for a message, cut off where it is long.
std::string shortened(std::string text, std::size_t most = 80);

}  // namespace edgewise::transfer
