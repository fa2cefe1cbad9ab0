#include "graph/parameters.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>

#include "graph/errors.hpp"
#include "graph/words.hpp"

namespace edgewise {

std::string text_of(const Value& value) {
    if (const auto* word = std::get_if<std::string>(&value)) return *word;
    return fmt::format("{}", std::get<double>(value));
}

std::string Parameters::text() const {
    std::string text;
    for (const auto& [key, value] : values_) text += "/" + key + "=" + text_of(value);
    return text;
}

Value Domain::parse(const std::string& edge, const std::string& key,
                    const std::string& text) const {
    if (!words.empty()) {
        const auto found = std::find_if(words.begin(), words.end(), [&](const std::string& word) {
            return same_word(word, text);
        });
        if (found != words.end()) return *found;
        throw RequestError(fmt::format("{}/{}={}: {}", edge, key, text, instead_of(text, words)));
    }
    double number = 0;
    const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (failed != std::errc() || end != text.data() + text.size() || !(number >= low) ||
        !(number <= high))
        throw RequestError(
            fmt::format("{}/{}={}: a number from {} to {}", edge, key, text, low, high));
    return number;
}

Domain one_of(std::vector<std::string> words, std::string meaning) {
    Domain domain{.words = std::move(words), .meaning = std::move(meaning)};
    domain.tried.assign(domain.words.begin(), domain.words.end());
    return domain;
}

Domain one_of(std::vector<std::string> words, std::vector<Value> tried, std::string meaning) {
    return {.words = std::move(words), .tried = std::move(tried), .meaning = std::move(meaning)};
}

Domain number(double low, double high, std::vector<double> tried, std::string meaning) {
    Domain domain{.low = low, .high = high, .meaning = std::move(meaning)};
    domain.tried.assign(tried.begin(), tried.end());
    return domain;
}

}  // namespace edgewise
