#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/transfer/curves.hpp"
#include "engine/transfer/fields.hpp"
#include "engine/transfer/formats.hpp"

namespace edgewise::transfer {
namespace {

constexpr const char* kPoint = "{\"value\": 300, \"opacity\": 0.05, \"color\": [1, 0.9, 0.8]}";
constexpr const char* kMaterial =
    "{\"ambient\": 0.1, \"diffuse\": 0.7, \"specular\": 0.2, \"exponent\": 10}";

Transfer::Point point_of(const nlohmann::json& json, const std::string& where,
                         const std::string& field) {
    if (!json.is_object())
        refuse(where, fmt::format("{} is no point; a point is {}", field, kPoint));
    expect_known(json, where, field + ".", {"value", "opacity", "color"});
    const std::string example = fmt::format("a point as {}", kPoint);
    const auto member = [&](const char* key) -> const nlohmann::json& {
        return member_of(json, key, where, field, example);
    };
    Transfer::Point point;
    point.value = number_in(member("value"), where, field + ".value", -1e300, 1e300);
    point.opacity = number_in(member("opacity"), where, field + ".opacity", 0, 1);
    point.color = color_in(member("color"), where, field + ".color");
    return point;
}

Material material_of(const nlohmann::json& json, const std::string& where) {
    if (!json.is_object()) refuse(where, fmt::format("material: expected {}", kMaterial));
    expect_known(json, where, "material.", {"ambient", "diffuse", "specular", "exponent"});
    const auto part = [&](const char* key, double low, double high) {
        return number_in(member_of(json, key, where, "material", kMaterial), where,
                         fmt::format("material.{}", key), low, high);
    };
    return {part("ambient", 0, 1), part("diffuse", 0, 1), part("specular", 0, 1),
            part("exponent", 1, 1024)};
}

constexpr const char* kEdge = "{\"magnitude\": 20, \"opacity\": 1}";

std::vector<Transfer::Edge> edges_of(const nlohmann::json& json, const std::string& where) {
    if (!json.is_array() || json.empty() || json.size() > kMostKnots)
        refuse(where, fmt::format("gradient: expected 1 to {} points as {}", kMostKnots, kEdge));
    std::vector<Transfer::Edge> edges;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const std::string field = fmt::format("gradient[{}]", i);
        if (!json[i].is_object())
            refuse(where, fmt::format("{} is no point; expected {}", field, kEdge));
        expect_known(json[i], where, field + ".", {"magnitude", "opacity"});
        const auto number = [&](const char* key, double high) {
            return number_in(member_of(json[i], key, where, field, kEdge), where,
                             fmt::format("{}.{}", field, key), 0, high);
        };
        edges.push_back({number("magnitude", 1e300), number("opacity", 1)});
        if (i > 0 && edges[i].magnitude < edges[i - 1].magnitude)
            refuse(where,
                   fmt::format("{}.magnitude is {}, less than {} before it; they must ascend",
                               field, edges[i].magnitude, edges[i - 1].magnitude));
    }
    return edges;
}

TransferValues values_of(const nlohmann::json& json, const std::string& where) {
    for (const TransferValues values :
         {TransferValues::data, TransferValues::hounsfield, TransferValues::window,
          TransferValues::range, TransferValues::labels})
        if (json == name_of(values)) return values;
    refuse(where,
           fmt::format("values is {}; expected \"data\", \"hounsfield\", \"window\", \"range\" "
                       "or \"labels\"",
                       shortened(json.dump())));
}

}  // namespace

TransferSpec own_transfer(const nlohmann::json& json, const std::string& where) {
    if (!json.is_object() || !json.contains("points") || !json["points"].is_array() ||
        json["points"].empty())
        refuse(where, fmt::format("points is missing; expected {{\"points\": [{}]}}, a preset of "
                                  "ParaView or a volume property of Slicer",
                                  kPoint));
    expect_known(json, where, "", {"points", "unit", "values", "material", "gradient"});
    TransferSpec read;
    Transfer& transfer = read.transfer;
    read.unit_given = json.contains("unit");
    if (read.unit_given) transfer.unit = number_in(json["unit"], where, "unit", 1e-12, 1e12);
    if (json.contains("values")) read.values = values_of(json["values"], where);
    if (json.contains("material")) read.material = material_of(json["material"], where);
    if (json.contains("gradient")) transfer.edges = edges_of(json["gradient"], where);
    for (std::size_t i = 0; i < json["points"].size(); ++i) {
        const std::string field = fmt::format("points[{}]", i);
        transfer.points.push_back(point_of(json["points"][i], where, field));
        if (i > 0 && transfer.points[i].value < transfer.points[i - 1].value)
            refuse(where,
                   fmt::format("{}.value is {}, less than {} before it; values must ascend", field,
                               transfer.points[i].value, transfer.points[i - 1].value));
    }
    return read;
}

}  // namespace edgewise::transfer
