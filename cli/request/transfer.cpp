#include <cmath>
#include <fmt/format.h>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/request/options.hpp"
#include "graph/errors.hpp"

namespace edgewise::cli {
namespace {

constexpr std::streamoff kLargestFile = 16 << 20;

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
    throw RequestError(fmt::format("--transfer {}: {}", file, what));
}

double number_in(const nlohmann::json& value, const std::string& file, const std::string& field,
                 double low, double high) {
    const double number = value.is_number() ? value.get<double>() : NAN;
    if (!(number >= low && number <= high))
        refuse(file, fmt::format("{} must be a number from {} to {}", field, low, high));
    return number;
}

Transfer::Point point_of(const nlohmann::json& json, const std::string& file,
                         const std::string& field) {
    if (!json.is_object()) refuse(file, field + " must be an object");
    Transfer::Point point;
    const auto member = [&](const char* key) -> const nlohmann::json& {
        const auto found = json.find(key);
        if (found == json.end()) refuse(file, fmt::format("{} has no '{}'", field, key));
        return *found;
    };
    point.value = number_in(member("value"), file, field + ".value", -1e300, 1e300);
    point.opacity = number_in(member("opacity"), file, field + ".opacity", 0, 1);
    const nlohmann::json& color = member("color");
    if (!color.is_array() || color.size() != 3)
        refuse(file, field + ".color must be three numbers from 0 to 1");
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
    const nlohmann::json json = nlohmann::json::parse(stream, shallow, false);
    if (json.is_discarded()) refuse(file, "is not JSON");
    return json;
}

}  // namespace

Transfer load_transfer(const std::string& file, double unit) {
    const nlohmann::json json = parsed(file);
    if (!json.is_object() || !json.contains("points") || !json["points"].is_array() ||
        json["points"].empty())
        refuse(file,
               "expected {\"points\": [{\"value\": v, \"opacity\": a, \"color\": [r, g, b]}]}");
    Transfer transfer;
    transfer.unit = unit;
    if (json.contains("unit")) transfer.unit = number_in(json["unit"], file, "unit", 1e-12, 1e12);
    for (std::size_t i = 0; i < json["points"].size(); ++i) {
        const std::string field = fmt::format("points[{}]", i);
        transfer.points.push_back(point_of(json["points"][i], file, field));
        if (i > 0 && transfer.points[i].value < transfer.points[i - 1].value)
            refuse(file, field + ".value is less than the one before it");
    }
    return transfer;
}

}  // namespace edgewise::cli
