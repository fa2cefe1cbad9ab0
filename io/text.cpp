#include "io/text.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>

#include "graph/errors.hpp"

namespace edgewise::store {
namespace {

constexpr std::string_view kBlanks = " \t\r\n\v\f";
constexpr std::size_t kLongestShown = 60;

bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

template <class T>
std::optional<T> number(std::string_view text) noexcept {
    text = trim(text);
    if (text.starts_with('+')) text.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

template <class T>
std::vector<T> numbers(const std::string& file, const std::string& field, std::string_view text,
                       const char* kind) {
    std::vector<T> values;
    for (std::string_view word : words(text)) {
        const auto value = number<T>(word);
        if (!value)
            refuse(file, "field '" + field + "' holds '" + shown(word) + "', expected " + kind);
        values.push_back(*value);
    }
    return values;
}

}  // namespace

void refuse(const std::string& file, const std::string& what) {
    throw InputError(file + ": " + what);
}

std::string_view trim(std::string_view text) noexcept {
    const auto first = text.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string lower(std::string_view text) {
    std::string low(text);
    for (char& c : low) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return low;
}

std::vector<std::string_view> words(std::string_view text) {
    std::vector<std::string_view> found;
    while (!(text = trim(text)).empty()) {
        const auto end = std::min(text.find_first_of(kBlanks), text.size());
        found.push_back(text.substr(0, end));
        text.remove_prefix(end);
    }
    return found;
}

std::vector<std::string_view> split(std::string_view text, char at) {
    std::vector<std::string_view> found;
    for (;;) {
        const auto end = text.find(at);
        found.push_back(text.substr(0, end));
        if (end == std::string_view::npos) return found;
        text.remove_prefix(end + 1);
    }
}

bool ends_with_any(std::string_view text, const std::vector<std::string>& endings) {
    const std::string low = lower(text);
    return std::any_of(endings.begin(), endings.end(),
                       [&](const std::string& ending) { return low.ends_with(ending); });
}

std::string shown(std::string_view text) {
    std::string clean;
    for (char c : text.substr(0, kLongestShown))
        clean += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
    return text.size() > kLongestShown ? clean + "..." : clean;
}

std::string unit_of_values(std::string_view text) {
    constexpr std::size_t kLongest = 16;
    text = trim(text);
    if (text.size() > 1 && text.front() == '"' && text.back() == '"')
        text = trim(text.substr(1, text.size() - 2));
    const std::string unit(text);
    return text.size() <= kLongest && text != "???" && shown(text) == unit ? unit : "";
}

std::string in_quotes(std::string_view text) {
    std::string quotes(1, '\'');
    return (quotes += shown(text)) += '\'';
}

std::optional<std::int64_t> to_integer(std::string_view text) noexcept {
    return number<std::int64_t>(text);
}
std::optional<double> to_double(std::string_view text) noexcept { return number<double>(text); }

std::vector<double> doubles(const std::string& file, const std::string& field,
                            std::string_view text) {
    return numbers<double>(file, field, text, "numbers");
}
std::vector<std::int64_t> integers(const std::string& file, const std::string& field,
                                   std::string_view text) {
    return numbers<std::int64_t>(file, field, text, "integers");
}

std::int64_t product(const std::string& file, std::int64_t a, std::int64_t b) {
    std::int64_t result = 0;
    if (__builtin_mul_overflow(a, b, &result))
        refuse(file, "sizes whose product does not fit into 63 bits");
    return result;
}

bool numeric_less(std::string_view a, std::string_view b) noexcept {
    std::size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        if (!is_digit(a[i]) || !is_digit(b[j])) {
            if (a[i] != b[j]) return a[i] < b[j];
            ++i, ++j;
            continue;
        }
        while (i < a.size() && a[i] == '0') ++i;
        while (j < b.size() && b[j] == '0') ++j;
        std::size_t m = i, n = j;
        while (m < a.size() && is_digit(a[m])) ++m;
        while (n < b.size() && is_digit(b[n])) ++n;
        if (m - i != n - j) return m - i < n - j;
        if (const int order = a.substr(i, m - i).compare(b.substr(j, n - j)); order != 0)
            return order < 0;
        i = m, j = n;
    }
    // Names that differ in leading zeros only still need one order.
    return a.size() - i != b.size() - j ? a.size() - i < b.size() - j : a < b;
}

}  // namespace edgewise::store
