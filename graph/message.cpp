#include "graph/message.hpp"

#include <ostream>

namespace edgewise {
namespace {

// Around a setting, and between its field and its value. No text that a person reads has them.
constexpr char kBegin = '\x11', kBetween = '\x12', kEnd = '\x13';

std::string mark(std::string_view field, std::string_view value) {
    std::string text(1, kBegin);
    text += field;
    if (!value.empty()) (text += kBetween) += value;
    return text += kEnd;
}

/// Tells the pieces of a marked text in order: what stands between settings, and these.
template <typename Plain, typename Named>
void each_piece(std::string_view text, const Plain& plain, const Named& named) {
    while (!text.empty()) {
        const std::size_t begin = text.find(kBegin);
        const std::size_t end = begin == text.npos ? text.npos : text.find(kEnd, begin);
        if (end == text.npos) return plain(text);
        plain(text.substr(0, begin));
        const std::string_view inside = text.substr(begin + 1, end - begin - 1);
        const std::size_t between = inside.find(kBetween);
        named(inside.substr(0, between),
              between == inside.npos ? std::string_view{} : inside.substr(between + 1));
        text.remove_prefix(end + 1);
    }
}

std::string in_own_voice(std::string_view field, std::string_view value) {
    if (field == Message::kCommand) return std::string(value);
    if (value.empty()) return std::string(field);
    return fmt::format("{}={}", field, value);
}

}  // namespace

std::string Message::text() const { return text(in_own_voice); }

std::string Message::text(const Speak& speak) const {
    std::string said;
    each_piece(
        marked_, [&](std::string_view plain) { said += plain; },
        [&](std::string_view field, std::string_view value) { said += speak(field, value); });
    return said;
}

std::vector<Setting> Message::settings() const {
    std::vector<Setting> found;
    each_piece(
        marked_, [](std::string_view) {},
        [&](std::string_view field, std::string_view value) {
            if (field != kCommand) found.push_back({std::string(field), std::string(value)});
        });
    return found;
}

std::ostream& operator<<(std::ostream& out, const Message& message) {
    return out << message.text();
}

namespace messages {

std::string with_marks(std::string_view text) {
    std::string marked;
    for (std::size_t at = 0; at < text.size();) {
        if (text[at] != '@') {
            marked += text[at++];
            continue;
        }
        if (text.substr(++at).starts_with('@')) {
            marked += text[at++];
            continue;
        }
        std::size_t end = at;
        while (end < text.size() && is_of_name(text[end])) ++end;
        const std::string_view field = text.substr(at, end - at);
        at = end;
        std::string_view value;
        if (text.substr(at).starts_with('(')) {
            const std::size_t close = text.find(')', at);
            value = text.substr(at + 1, close - at - 1);
            at = close + 1;
        }
        marked += mark(field, value);
    }
    return marked;
}

}  // namespace messages

Message message_of(std::string_view text) { return messages::with_marks(text); }

Message setting(SettingName field, std::string_view value) { return mark(field.name, value); }

}  // namespace edgewise
