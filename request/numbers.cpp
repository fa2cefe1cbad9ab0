#include "request/numbers.hpp"

#include <charconv>
#include <cmath>
#include <fmt/format.h>

#include "request/errors.hpp"

namespace edgewise {

std::vector<std::string> split(std::string_view text, char separator) {
    std::vector<std::string> words;
    for (std::size_t begin = 0;;) {
        const std::size_t end = text.find(separator, begin);
        words.emplace_back(text.substr(begin, end - begin));
        if (end == std::string_view::npos) return words;
        begin = end + 1;
    }
}

double number_of(const Message& name, std::string_view text) {
    std::string_view digits = text;
    if (digits.size() > 1 && digits.front() == '+' && digits[1] != '-') digits.remove_prefix(1);
    double value = 0;
    const auto [end, failed] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (failed != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value))
        throw RequestError(message("{}: '{}' is not a finite number", name, text));
    return value;
}

std::vector<double> numbers_of(const Message& name, std::string_view text) {
    std::vector<double> values;
    for (const std::string& word : split(text, ',')) values.push_back(number_of(name, word));
    return values;
}

std::int64_t whole_of(const Message& name, std::string_view text, std::int64_t low,
                      std::int64_t high) {
    std::int64_t value = 0;
    const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failed != std::errc() || end != text.data() + text.size() || value < low || value > high)
        throw OutOfLimits(
            message("{}: '{}' is not a whole number from {} to {}", name, text, low, high),
            Limits::between(static_cast<double>(low), static_cast<double>(high)));
    return value;
}

}  // namespace edgewise
