#include "graph/words.hpp"

#include <algorithm>
#include <cstddef>
#include <fmt/format.h>

namespace edgewise {
namespace {

constexpr std::size_t kLongest = 64;  // letters; what is longer is no mistyped name
constexpr std::size_t kFew = 12;      // names that a message may list

/// Letters to add, leave out, exchange or swap with the next (optimal string alignment).
std::size_t distance(const std::string& a, const std::string& b) {
    std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t other = a[i - 1] == b[j - 1] ? 0 : 1;
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + other});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
        std::swap(before, last);
        std::swap(last, row);
    }
    return last[b.size()];
}

}  // namespace

std::string lower(std::string_view text) {
    std::string low(text);
    for (char& c : low)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return low;
}

bool same_word(std::string_view a, std::string_view b) { return lower(a) == lower(b); }

std::string nearest_name(std::string_view word, const std::vector<std::string>& names) {
    if (word.empty() || word.size() > kLongest) return {};
    const std::string typed = lower(word);
    std::string best;
    double least = 2.0 / 5 + 1e-9;  // of the letters of the longer one
    for (const std::string& name : names) {
        const std::string low = lower(name);
        double far = double(distance(typed, low)) / double(std::max(typed.size(), low.size()));
        if (typed.size() >= 3 && low.starts_with(typed)) far = std::min(far, 0.3);
        if (far < least) least = far, best = name;
    }
    return best;
}

std::string instead_of(std::string_view word, const std::vector<std::string>& names,
                       std::string_view otherwise) {
    const std::string near = nearest_name(word, names);
    if (!near.empty()) return fmt::format("did you mean {}?", near);
    if (names.size() <= kFew && otherwise.empty())
        return fmt::format("expected one of {}", fmt::join(names, ", "));
    return std::string(otherwise);
}

}  // namespace edgewise
