#include "engine/request/transfer.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "graph/errors.hpp"

namespace edgewise {
namespace {

constexpr std::streamoff kLargestFile = 16 << 20;

constexpr const char* kPoint = "{\"value\": 300, \"opacity\": 0.05, \"color\": [1, 0.9, 0.8]}";

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
    throw RequestError(fmt::format("--transfer {}: {}", file, what));
}

double number_in(const nlohmann::json& value, const std::string& file, const std::string& field,
                 double low, double high) {
    const double number = value.is_number() ? value.get<double>() : NAN;
    if (!(number >= low && number <= high))
        refuse(file, fmt::format("{} is {}; expected a number from {} to {}", field, value.dump(),
                                 low, high));
    return number;
}

/// A mistyped key would be left out without a word.
void expect_known(const nlohmann::json& json, const std::string& file, const std::string& within,
                  std::vector<std::string> keys) {
    keys.insert(keys.end(), {"name", "comment"});
    for (const auto& item : json.items())
        if (std::find(keys.begin(), keys.end(), item.key()) == keys.end())
            refuse(file, fmt::format("{}{} is not known; there are {}", within, item.key(),
                                     fmt::join(keys, ", ")));
}

Transfer::Point point_of(const nlohmann::json& json, const std::string& file,
                         const std::string& field) {
    if (!json.is_object())
        refuse(file, fmt::format("{} is no point; a point is {}", field, kPoint));
    expect_known(json, file, field + ".", {"value", "opacity", "color"});
    Transfer::Point point;
    const auto member = [&](const char* key) -> const nlohmann::json& {
        const auto found = json.find(key);
        if (found == json.end())
            refuse(file, fmt::format("{} has no '{}'; a point is {}", field, key, kPoint));
        return *found;
    };
    point.value = number_in(member("value"), file, field + ".value", -1e300, 1e300);
    point.opacity = number_in(member("opacity"), file, field + ".opacity", 0, 1);
    const nlohmann::json& color = member("color");
    if (!color.is_array() || color.size() != 3)
        refuse(file, fmt::format("{}.color is {}; expected three numbers from 0 to 1, as in {}",
                                 field, color.dump(), kPoint));
    for (std::size_t c = 0; c < 3; ++c)
        point.color[c] = number_in(color[c], file, fmt::format("{}.color[{}]", field, c), 0, 1);
    return point;
}

nlohmann::json parsed(const std::string& file) {
    std::ifstream stream(file, std::ios::binary | std::ios::ate);
    if (!stream) refuse(file, "cannot be read");
    if (stream.tellg() > kLargestFile) refuse(file, "is larger than any transfer function");
    stream.seekg(0);
    // A parser that descends would overflow the stack on a million brackets; points take 4 levels.
    const auto shallow = [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
        if (depth > 16) refuse(file, "is nested too deeply");
        return true;
    };
    try {
        return nlohmann::json::parse(stream, shallow);
    } catch (const nlohmann::json::exception& error) {
        refuse(file, fmt::format("is not JSON: {}", error.what()));
    }
}

}  // namespace

TransferSpec load_transfer(const std::string& file) {
    const nlohmann::json json = parsed(file);
    if (!json.is_object() || !json.contains("points") || !json["points"].is_array() ||
        json["points"].empty())
        refuse(file, fmt::format("points is missing; expected {{\"points\": [{}]}}", kPoint));
    expect_known(json, file, "", {"points", "unit"});
    TransferSpec read;
    Transfer& transfer = read.transfer;
    read.unit_given = json.contains("unit");
    if (read.unit_given) transfer.unit = number_in(json["unit"], file, "unit", 1e-12, 1e12);
    for (std::size_t i = 0; i < json["points"].size(); ++i) {
        const std::string field = fmt::format("points[{}]", i);
        transfer.points.push_back(point_of(json["points"][i], file, field));
        if (i > 0 && transfer.points[i].value < transfer.points[i - 1].value)
            refuse(file,
                   fmt::format("{}.value is {}, less than {} before it; values must ascend", field,
                               transfer.points[i].value, transfer.points[i - 1].value));
    }
    return read;
}

}  // namespace edgewise
