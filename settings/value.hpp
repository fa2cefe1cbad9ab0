#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "graph/errors.hpp"

namespace edgewise {

/// What is given for a setting: a text, as people type it, or what programs have: a truth, a
/// number, or a list of values. Numbers and lists mean what they would mean as a text: 0.02 is
/// "0.02", and (1, 2, 3) is "1,2,3".
class SettingValue {
 public:
    using List = std::vector<SettingValue>;

    SettingValue() = default;  // nothing is given
    SettingValue(bool truth) : held_(truth) {}
    template <std::integral T>
    SettingValue(T number) : held_(static_cast<std::int64_t>(number)) {}
    SettingValue(double number) : held_(number) {}
    SettingValue(const char* text) : held_(std::string(text)) {}
    SettingValue(std::string text) : held_(std::move(text)) {}
    SettingValue(List list) : held_(std::move(list)) {}
    /// A list of numbers or texts.
    template <typename Range>
    static SettingValue of(const Range& range) {
        return List(range.begin(), range.end());
    }

    bool none() const noexcept { return std::holds_alternative<std::monostate>(held_); }
    bool is_text() const noexcept { return std::holds_alternative<std::string>(held_); }
    bool is_list() const noexcept { return std::holds_alternative<List>(held_); }
    bool is_truth() const noexcept { return std::holds_alternative<bool>(held_); }
    /// Its values; of what is no list, itself alone.
    List values() const;
    /// As it would be typed. @param separator  between the values of a list, and of lists in it
    std::string text(char separator = ',') const;

    template <typename Visitor>
    decltype(auto) visit(Visitor&& visitor) const {
        return std::visit(std::forward<Visitor>(visitor), held_);
    }
    bool operator==(const SettingValue&) const = default;

 private:
    std::variant<std::monostate, bool, std::int64_t, double, std::string, List> held_;
};

/// There is no such setting, the job does not have it, or its values are of another kind.
struct SettingError : RequestError {
    using RequestError::RequestError;
};

}  // namespace edgewise
