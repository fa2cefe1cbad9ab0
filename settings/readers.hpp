#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "request/numbers.hpp"
#include "request/quantities.hpp"
#include "settings/setting.hpp"

/// Readers that many settings share. Each is made for a field of the query, which is named by
/// pointers to members: `number(&Query::geometry, &GeometrySpec::zoom)`.
namespace edgewise::reads {

template <typename Of, typename First, typename... Rest>
auto& member(Of& of, First first, Rest... rest) {
    if constexpr (sizeof...(Rest) == 0)
        return of.*first;
    else
        return member(of.*first, rest...);
}

/// A text or number, and no list. @throws SettingError
std::string word(const SettingValue& value, const Message& called);
/// A truth, or the text of one. @throws SettingError
bool truth(const SettingValue& value, const Message& called);
/// Finite numbers: of a text those between commas. @throws RequestError
std::vector<double> numbers(const SettingValue& value, const Message& called);
/// So many of them. @throws RequestError that says what was `expected`
template <std::size_t count>
std::array<double, count> exactly(const SettingValue& value, const Message& called,
                                  const char* expected) {
    const std::vector<double> given = numbers(value, called);
    if (given.size() != count)
        throw RequestError(message("{}: '{}' given; expected {}", called, value.text(), expected));
    std::array<double, count> all;
    std::copy(given.begin(), given.end(), all.begin());
    return all;
}
/// The values of a list: itself alone where it is one of numbers.
SettingValue::List items(const SettingValue& value);
/// A number within limits. @throws OutOfLimits
double expect_within(const Limits& limits, double number, const Message& called);
/// The place of a word, in any case, in a list. @throws OutOfLimits naming the nearest
int place_of(const std::string& given, const Message& called,
             const std::vector<std::string>& words);

/// Of a field that may be absent, or not.
template <typename T>
SettingValue told(const T& field) {
    return SettingValue(field);
}
template <typename T>
SettingValue told(const std::vector<T>& field) {
    return field.empty() ? SettingValue() : SettingValue::of(field);
}
template <typename T, std::size_t count>
SettingValue told(const std::array<T, count>& field) {
    return SettingValue::of(field);
}
template <typename T>
SettingValue told(const std::optional<T>& field) {
    return field ? told(*field) : SettingValue();
}

/// A reader whose texts become the field's value by `parse(word, called)`.
template <typename Parse, typename... Members>
Reader parsed(Parse parse, Members... members) {
    return {.take =
                [=](Query& query, const SettingValue& value, const Reading& reading) {
                    const Message called = reading.called();
                    member(query, members...) = parse(word(value, called), called);
                },
            .tell = [=](const Query& query) { return told(member(query, members...)); }};
}

/// The same of texts that may have several parts, for which a list will do.
template <typename Parse, typename Tell, typename... Members>
Reader parts(Parse parse, Tell tell, Members... members) {
    return {.take =
                [=](Query& query, const SettingValue& value, const Reading& reading) {
                    member(query, members...) = parse(value.text(), reading.called());
                },
            .tell =
                [=](const Query& query) {
                    const auto& field = member(query, members...);
                    return field ? SettingValue(tell(*field)) : SettingValue();
                }};
}

template <typename... Members>
Reader flag(Members... members) {
    return {
        .take =
            [=](Query& query, const SettingValue& value, const Reading& reading) {
                member(query, members...) = truth(value, reading.called());
            },
        .tell = [=](const Query& query) { return SettingValue(bool(member(query, members...))); },
        .kind = Reader::Kind::flag};
}

/// The same, with limits that its errors tell.
inline Reader with_limits(Limits limits, Reader reader) {
    reader.limits = std::move(limits);
    return reader;
}

template <typename... Members>
Reader number(Members... members) {
    return parsed(
        [](const std::string& text, const Message& called) { return number_of(called, text); },
        members...);
}

template <typename... Members>
Reader number_in(const Limits& limits, Members... members) {
    return with_limits(limits, parsed(
                                   [limits](const std::string& text, const Message& called) {
                                       return expect_within(limits, number_of(called, text),
                                                            called);
                                   },
                                   members...));
}

template <typename... Members>
Reader whole(std::int64_t low, std::int64_t high, Members... members) {
    const auto read = [=](const std::string& text, const Message& called) {
        using Field = std::remove_cvref_t<decltype(member(std::declval<Query&>(), members...))>;
        const std::int64_t number = whole_of(called, text, low, high);
        if constexpr (std::integral<Field>)
            return static_cast<Field>(number);
        else
            return static_cast<typename Field::value_type>(number);
    };
    return with_limits(Limits::between(static_cast<double>(low), static_cast<double>(high)),
                       parsed(read, members...));
}

template <typename... Members>
Reader text(Members... members) {
    return parsed([](const std::string& given, const Message&) { return given; }, members...);
}

/// One of some words, the values of an enumeration in their order.
template <typename... Members>
Reader choice(std::vector<std::string> words, Members... members) {
    using Field = std::remove_cvref_t<decltype(member(std::declval<Query&>(), members...))>;
    constexpr bool is_optional = !std::is_enum_v<Field>;
    Reader reader;
    reader.limits.allowed = words;
    reader.take = [=](Query& query, const SettingValue& value, const Reading& reading) {
        const int place = place_of(word(value, reading.called()), reading.called(), words);
        if constexpr (is_optional)
            member(query, members...) = static_cast<typename Field::value_type>(place);
        else
            member(query, members...) = static_cast<Field>(place);
    };
    reader.tell = [=](const Query& query) -> SettingValue {
        const auto& field = member(query, members...);
        if constexpr (is_optional)
            return field ? SettingValue(words[static_cast<std::size_t>(*field)]) : SettingValue();
        else
            return words[static_cast<std::size_t>(field)];
    };
    return reader;
}

/// Numbers, one or one an axis.
template <typename... Members>
Reader list_of_numbers(Members... members) {
    return {.take =
                [=](Query& query, const SettingValue& value, const Reading& reading) {
                    member(query, members...) = numbers(value, reading.called());
                },
            .tell = [=](const Query& query) { return told(member(query, members...)); }};
}

/// The same, each within limits.
template <typename... Members>
Reader list_within(const Limits& limits, Members... members) {
    Reader reader = list_of_numbers(members...);
    reader.limits = limits;
    reader.take = [=](Query& query, const SettingValue& value, const Reading& reading) {
        std::vector<double> all = numbers(value, reading.called());
        for (const double one : all) expect_within(limits, one, reading.called());
        member(query, members...) = std::move(all);
    };
    return reader;
}

template <std::size_t count, typename... Members>
Reader so_many_numbers(const char* expected, Members... members) {
    return {.take =
                [=](Query& query, const SettingValue& value, const Reading& reading) {
                    member(query, members...) = exactly<count>(value, reading.called(), expected);
                },
            .tell = [=](const Query& query) { return told(member(query, members...)); }};
}

/// "50ms", or seconds.
template <typename... Members>
Reader duration(Members... members) {
    return with_limits(Limits::from(0),
                       parsed([](const std::string& text,
                                 const Message& called) { return time_budget(text, called); },
                              members...));
}

/// A list of values that `parse(value, called)` reads and `tell` tells.
template <typename Parse, typename Tell, typename... Members>
Reader list(Parse parse, Tell tell, Members... members) {
    return {.take =
                [=](Query& query, const SettingValue& value, const Reading& reading) {
                    auto& field = member(query, members...);
                    field.clear();
                    for (const SettingValue& one : items(value))
                        field.push_back(parse(one, reading.called()));
                },
            .tell =
                [=](const Query& query) {
                    SettingValue::List values;
                    for (const auto& one : member(query, members...)) values.push_back(tell(one));
                    return values.empty() ? SettingValue() : SettingValue(values);
                },
            .kind = Reader::Kind::list};
}

}  // namespace edgewise::reads
