#include "transfer/fields.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "graph/errors.hpp"

namespace edgewise::transfer {

void refuse(const std::string& where, const std::string& what) {
    throw RequestError(fmt::format("{}: {}", where, what));
}

std::string shortened(std::string text, std::size_t most) {
    return text.size() <= most ? text : text.substr(0, most) + "...";
}

double number_in(const nlohmann::json& value, const std::string& where, const std::string& field,
                 double low, double high) {
    const double number = value.is_number() ? value.get<double>() : NAN;
    if (!(number >= low && number <= high))
        refuse(where, fmt::format("{} is {}; expected a number from {} to {}", field,
                                  shortened(value.dump()), low, high));
    return number;
}

const nlohmann::json& member_of(const nlohmann::json& json, const char* key,
                                const std::string& where, const std::string& field,
                                const std::string& example) {
    const auto found = json.find(key);
    if (found == json.end())
        refuse(where, fmt::format("{} has no '{}'; expected {}", field, key, example));
    return *found;
}

void expect_known(const nlohmann::json& json, const std::string& where, const std::string& within,
                  std::vector<std::string> keys) {
    keys.insert(keys.end(), {"name", "comment"});
    for (const auto& item : json.items())
        if (std::find(keys.begin(), keys.end(), item.key()) == keys.end())
            refuse(where, fmt::format("{}{} is not known; there are {}", within,
                                      shortened(item.key()), fmt::join(keys, ", ")));
}

std::array<double, 3> color_in(const nlohmann::json& value, const std::string& where,
                               const std::string& field) {
    if (!value.is_array() || value.size() != 3)
        refuse(where, fmt::format("{} is {}; expected three numbers from 0 to 1, as in \"color\": "
                                  "[1, 0.9, 0.8]",
                                  field, shortened(value.dump())));
    std::array<double, 3> color{};
    for (std::size_t c = 0; c < 3; ++c)
        color[c] = number_in(value[c], where, fmt::format("{}[{}]", field, c), 0, 1);
    return color;
}

}  // namespace edgewise::transfer
