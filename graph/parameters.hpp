#pragma once

#include <map>
#include <string>
#include <variant>
#include <vector>

namespace edgewise {

/// A value of a parameter: a word or a number.
using Value = std::variant<std::string, double>;
std::string text_of(const Value& value);

/// The values that one offer of an edge is made with: filter order, step, width ...
class Parameters {
 public:
    Parameters() = default;
    Parameters(std::initializer_list<std::pair<const std::string, Value>> values)
        : values_(values) {}

    /// A word. Throws std::out_of_range where the edge did not declare the key.
    const std::string& word(const std::string& key) const {
        return std::get<std::string>(values_.at(key));
    }
    double number(const std::string& key) const { return std::get<double>(values_.at(key)); }
    void set(const std::string& key, Value value) { values_[key] = std::move(value); }
    bool contains(const std::string& key) const { return values_.contains(key); }
    const std::map<std::string, Value>& all() const noexcept { return values_; }
    /// "/filter=foh/step=1": what follows the name of an edge in `via`. Keys in alphabetical
    /// order.
    std::string text() const;

    friend bool operator==(const Parameters&, const Parameters&) = default;

 private:
    std::map<std::string, Value> values_;
};

/// What values a parameter may take, and which few of them the planner tries.
struct Domain {
    std::vector<std::string> words = {};  // all words; empty: a number
    double low = 0, high = 0;             // range of a number, both ends included
    std::vector<Value> tried = {};
    std::string meaning = {};  // unit and use, for `edgewise list edges`

    /// The value that a text stands for. @throws RequestError naming what is allowed
    Value parse(const std::string& edge, const std::string& key, const std::string& text) const;
};

/// Words, all of them tried, or only a few.
Domain one_of(std::vector<std::string> words, std::string meaning = {});
Domain one_of(std::vector<std::string> words, std::vector<Value> tried, std::string meaning);
/// A number between two ends, of which the planner tries a few.
Domain number(double low, double high, std::vector<double> tried, std::string meaning = {});

}  // namespace edgewise
