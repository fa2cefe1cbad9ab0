#pragma once

#include <fmt/format.h>
#include <functional>
#include <iosfwd>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "graph/settings.hpp"

namespace edgewise {

/// A field of the query that a message names, and the value that it has or should have ("": none is
/// named).
struct Setting {
    std::string field, value;
    bool operator==(const Setting&) const = default;
};

/// A sentence for people that says which fields of the query it is about. A plain text is one that
/// names none.
class Message {
 public:
    /// How a setting is called; `value` may be "".
    using Speak = std::function<std::string(std::string_view field, std::string_view value)>;
    /// What stands as the field where a message names one of the verbs: "calibrate".
    static constexpr std::string_view kCommand = "command";

    Message() = default;
    Message(std::string text) : marked_(std::move(text)) {}  // NOLINT: texts are messages
    Message(const char* text) : marked_(text) {}             // NOLINT

    /// In the voice of the library: "max_error", "size=fit".
    std::string text() const;
    /// In another voice.
    std::string text(const Speak& speak) const;
    /// The settings that it names, in order. The first one is what is wrong, or what it is about.
    std::vector<Setting> settings() const;

    /// As it is kept: each setting between marks. Texts that are made of it are messages again.
    const std::string& marked() const noexcept { return marked_; }
    bool empty() const noexcept { return marked_.empty(); }
    bool operator==(const Message&) const = default;
    friend std::ostream& operator<<(std::ostream&, const Message&);

 private:
    std::string marked_;
};

namespace messages {

constexpr bool is_of_name(char c) noexcept { return (c >= 'a' && c <= 'z') || c == '_'; }

/// Stops the compiler: a text names what is no setting, or leaves a value open.
inline void no_such_setting() {}

constexpr void expect_settings(std::string_view text) {
    for (std::size_t at = text.find('@'); at != std::string_view::npos; at = text.find('@', at)) {
        if (text.substr(++at).starts_with('@')) {
            ++at;
            continue;
        }
        std::size_t end = at;
        while (end < text.size() && is_of_name(text[end])) ++end;
        const std::string_view name = text.substr(at, end - at);
        if (name != Message::kCommand && !is_setting(name)) no_such_setting();
        if (text.substr(end).starts_with('(') && text.find(')', end) == std::string_view::npos)
            no_such_setting();
        at = end;
    }
}

/// A format string whose settings and arguments the compiler has checked.
template <typename... Args>
struct Format {
    template <typename Text>
    consteval Format(const Text& text) : format(text) {  // NOLINT: as fmt::format_string
        expect_settings(text);
    }
    std::string_view view() const {
        const fmt::string_view text = format;
        return {text.data(), text.size()};
    }
    fmt::format_string<Args...> format;
};

/// Messages within messages keep their settings.
inline const std::string& in_format(const Message& message) { return message.marked(); }
template <typename T>
const T& in_format(const T& value) {
    return value;
}
template <typename T>
using InFormat = std::conditional_t<std::is_same_v<T, Message>, std::string, T>;

std::string with_marks(std::string_view text);

}  // namespace messages

/// A message, made as by fmt::format. The text names settings by `@field` or `@field(value)`; `@@`
/// is an @, `@command(verb)` one of the verbs. The arguments may be messages.
///
///     message("@zoom: {} is not greater than 0; @size({}x{}) keeps all", zoom, x, y)
template <typename... Args>
Message message(std::type_identity_t<messages::Format<messages::InFormat<Args>...>> text,
                const Args&... args) {
    return fmt::vformat(messages::with_marks(text.view()),
                        fmt::make_format_args(messages::in_format(args)...));
}

/// The same of a text that is not known when the compiler runs; it has no arguments.
Message message_of(std::string_view text);

/// The name of a setting, checked by the compiler.
struct SettingName {
    template <typename Text>
    consteval SettingName(const Text& text) : name(text) {  // NOLINT
        if (!is_setting(name)) messages::no_such_setting();
    }
    std::string_view name;
};

/// A message that is the name of a setting, and nothing else.
Message setting(SettingName field, std::string_view value = {});

}  // namespace edgewise
