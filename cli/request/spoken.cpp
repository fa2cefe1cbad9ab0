#include "cli/request/spoken.hpp"

#include <algorithm>
#include <array>

namespace edgewise::cli {
namespace {

struct Called {
    std::string_view setting, option;
};
/// Options that are not called as the setting with dashes.
constexpr Called kCalled[] = {
    {"balls", "--clip-ball"},
    {"box", "--clip"},
    {"crop", "--clip"},
    {"cue", "--depth-cue"},
    {"grid_moves", "--move"},
    {"lids", "--close"},
    {"lights", "--light"},
    {"occlusion", "--ambient-occlusion"},
    {"out", "-o"},
    {"planes", "--clip-plane"},
};

/// Options whose value may be left out: one that stands there follows an equals sign.
constexpr std::array<std::string_view, 2> kMayBeBare = {"labels", "verify"};

std::string words_of(std::string_view setting, std::string_view value) {
    if (setting == Message::kCommand) return fmt::format("edgewise {}", value);
    std::string words = option_of(setting);
    if (value.empty()) return words;
    const bool bare = std::find(kMayBeBare.begin(), kMayBeBare.end(), setting) != kMayBeBare.end();
    if (setting == "grid_moves") value = value == "true" ? "grid" : "content";
    words += bare ? '=' : ' ';
    return words += value;
}

}  // namespace

std::string option_of(std::string_view setting) {
    for (const Called& called : kCalled)
        if (called.setting == setting) return std::string(called.option);
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
