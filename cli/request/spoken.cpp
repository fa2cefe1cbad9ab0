#include "cli/request/spoken.hpp"

#include <algorithm>
#include <ranges>

#include "settings/settings.hpp"

namespace edgewise::cli {
namespace {

/// The first row of a setting; null: it is the command's own.
const QuerySetting* row_of(std::string_view setting) {
    const auto found = std::ranges::find_if(
        settings(), [&](const QuerySetting* row) { return row->name.name == setting; });
    return found == settings().end() ? nullptr : *found;
}

std::string words_of(std::string_view setting, std::string_view value) {
    if (setting == Message::kCommand) return fmt::format("edgewise {}", value);
    std::string words = option_of(setting);
    if (value.empty()) return words;
    // Where a value may be left out, one that stands there follows an equals sign.
    const QuerySetting* row = row_of(setting);
    const bool bare = row && row->kind() == Reader::Kind::bare;
    if (setting == "grid_moves") value = value == "true" ? "grid" : "content";
    words += bare ? '=' : ' ';
    return words += value;
}

}  // namespace

std::string option_of(std::string_view setting) {
    if (const QuerySetting* row = row_of(setting)) return row->typed();
    std::string option = "--" + std::string(setting);
    std::replace(option.begin(), option.end(), '_', '-');
    return option;
}

std::string spoken(const Message& message) { return message.text(words_of); }

std::vector<std::string> spoken(const std::vector<Message>& messages) {
    std::vector<std::string> words;
    for (const Message& message : messages) words.push_back(spoken(message));
    return words;
}

}  // namespace edgewise::cli
