#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace edgewise::transfer {

// Files of several presets: a list of objects with a "name" or "Name", the same under one key of an
// object, or objects by their names.

/// "FILE#NAME" in parts; a file whose own name has a # is taken whole.
struct NamedFile {
    std::string file;
    std::optional<std::string> name;
};
NamedFile named_file(const std::string& word);

/// The preset of a name, in any case, or the only one. What holds no presets comes back as it is.
/// @throws RequestError several and no name, or another one: with the names there are
const nlohmann::json& preset_named_in(const nlohmann::json& json,
                                      const std::optional<std::string>& name,
                                      const std::string& where);

}  // namespace edgewise::transfer
