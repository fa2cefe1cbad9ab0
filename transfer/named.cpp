#include "transfer/named.hpp"

#include <filesystem>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "graph/words.hpp"
#include "transfer/fields.hpp"

namespace edgewise::transfer {
namespace {

using Json = nlohmann::json;
using Presets = std::vector<std::pair<std::string, const Json*>>;

bool is_preset(const Json& json) {
    return json.is_object() && (json.contains("colorTransfer") || json.contains("RGBPoints") ||
                                json.contains("IndexedColors"));
}

std::string name_in(const Json& preset, const std::string& otherwise) {
    for (const char* key : {"name", "Name"})
        if (preset.contains(key) && preset[key].is_string()) return preset[key].get<std::string>();
    return otherwise;
}

Presets presets_in(const Json& json) {
    Presets presets;
    if (json.is_array()) {
        for (const Json& one : json)
            if (is_preset(one)) presets.emplace_back(name_in(one, ""), &one);
        return presets;
    }
    if (!json.is_object() || is_preset(json)) return presets;
    for (const auto& [key, value] : json.items()) {
        if (is_preset(value)) presets.emplace_back(name_in(value, key), &value);
        if (value.is_array())
            for (auto& one : presets_in(value)) presets.push_back(std::move(one));
    }
    return presets;
}

std::string names_of(const Presets& presets) {
    constexpr std::size_t kMost = 40;
    std::vector<std::string> names;
    for (const auto& [name, json] : presets) {
        if (names.size() == kMost) break;
        names.push_back(shortened(name));
    }
    return fmt::format(
        "{}{}", fmt::join(names, ", "),
        presets.size() > kMost ? fmt::format(" and {} more", presets.size() - kMost) : "");
}

}  // namespace

NamedFile named_file(const std::string& word) {
    std::error_code none;
    const std::size_t at = word.rfind('#');
    if (at == word.npos || at == 0 || std::filesystem::exists(word, none)) return {word, {}};
    return {word.substr(0, at), word.substr(at + 1)};
}

const Json& preset_named_in(const Json& json, const std::optional<std::string>& name,
                            const std::string& where) {
    const Presets presets = presets_in(json);
    if (!name) {
        if (presets.empty()) return json;
        if (presets.size() == 1) return *presets[0].second;
        refuse(where, fmt::format("holds {} presets; name one behind a #, as FILE#{}: {}",
                                  presets.size(), presets[0].first, names_of(presets)));
    }
    if (presets.empty()) {
        if (same_word(name_in(json, ""), *name)) return json;
        refuse(where, fmt::format("holds no presets with names; leave out #{}", shortened(*name)));
    }
    std::vector<std::string> names;
    for (const auto& [known, preset] : presets) {
        if (same_word(known, *name)) return *preset;
        names.push_back(known);
    }
    const std::string near = nearest_name(*name, names);
    refuse(where, fmt::format("holds no preset '{}'; {}", shortened(*name),
                              near.empty() ? "it has " + names_of(presets)
                                           : fmt::format("did you mean {}?", near)));
}

}  // namespace edgewise::transfer
