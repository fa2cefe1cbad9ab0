#include "settings/value.hpp"

#include <fmt/format.h>

namespace edgewise {
namespace {

struct AsText {
    char separator;

    std::string operator()(std::monostate) const { return {}; }
    std::string operator()(bool truth) const { return truth ? "true" : "false"; }
    // The shortest text that is read as the same number.
    std::string operator()(std::int64_t number) const { return fmt::format("{}", number); }
    std::string operator()(double number) const { return fmt::format("{}", number); }
    std::string operator()(const std::string& text) const { return text; }
    std::string operator()(const SettingValue::List& list) const {
        std::string text;
        for (const SettingValue& one : list)
            text += (&one == &list.front() ? "" : std::string(1, separator)) + one.text(separator);
        return text;
    }
};

}  // namespace

SettingValue::List SettingValue::values() const {
    const List* list = std::get_if<List>(&held_);
    return list ? *list : List{*this};
}

std::string SettingValue::text(char separator) const { return visit(AsText{separator}); }

}  // namespace edgewise
