#include "settings/readers.hpp"

#include <algorithm>
#include <fmt/format.h>

#include "graph/words.hpp"

namespace edgewise::reads {
namespace {

void add_numbers(std::vector<double>& all, const SettingValue& value, const Message& called) {
    if (value.is_list())
        for (const SettingValue& one : value.values()) add_numbers(all, one, called);
    else
        all.push_back(number_of(called, value.text()));
}

}  // namespace

std::string word(const SettingValue& value, const Message& called) {
    if (value.is_list())
        throw SettingError(
            message("{}: one value is expected, and not the list {}", called, value.text()));
    return value.text();
}

bool truth(const SettingValue& value, const Message& called) {
    const std::string given = word(value, called);
    if (given.empty() || same_word(given, "true")) return true;
    if (same_word(given, "false")) return false;
    throw SettingError(message("{}: '{}' is neither true nor false", called, given));
}

std::vector<double> numbers(const SettingValue& value, const Message& called) {
    if (value.is_text()) return numbers_of(called, value.text());
    std::vector<double> all;
    add_numbers(all, value, called);
    return all;
}

double expect_within(const Limits& limits, double number, const Message& called) {
    if (limits.hold(number)) return number;
    const auto refuse = [&](const Message& why) -> double { throw OutOfLimits(why, limits); };
    if (limits.least && limits.greatest)
        return refuse(limits.open_below && limits.open_above
                          ? message("{}: {} is not between {} and {}", called, number,
                                    *limits.least, *limits.greatest)
                          : message("{}: {} is not from {} to {}", called, number, *limits.least,
                                    *limits.greatest));
    if (limits.greatest)
        return refuse(message("{}: {} is greater than {}", called, number, *limits.greatest));
    return refuse(limits.open_below
                      ? message("{}: {} is not greater than {}", called, number, *limits.least)
                      : message("{}: {} is less than {}", called, number, *limits.least));
}

SettingValue::List items(const SettingValue& value) {
    const SettingValue::List all = value.values();
    const bool of_numbers = std::all_of(all.begin(), all.end(), [](const SettingValue& one) {
        return !one.is_list() && !one.is_text();
    });
    return of_numbers && !all.empty() ? SettingValue::List{value} : all;
}

int place_of(const std::string& given, const Message& called,
             const std::vector<std::string>& words) {
    const auto found = std::find_if(words.begin(), words.end(), [&](const std::string& name) {
        return same_word(given, name);
    });
    if (found != words.end()) return static_cast<int>(found - words.begin());
    const std::string all = fmt::format("expected one of {}", fmt::join(words, ", "));
    throw OutOfLimits(
        message("{}: '{}' is not known; {}", called, given, instead_of(given, words, all)),
        Limits::words(words));
}

}  // namespace edgewise::reads
