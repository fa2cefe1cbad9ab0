#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "graph/transfer_table.hpp"
#include "transfer/curves.hpp"
#include "transfer/fields.hpp"
#include "transfer/formats.hpp"

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

constexpr const char* kTable =
    "{\"values\": [0, 100], \"gradients\": [0, 20], \"opacity\": [[0, 0], [0, 0.5]]}: a row for "
    "each "
    "gradient, a number for each value";

// Parts of a table, of which there are many: they get names where something is wrong with them.

double number_at(const nlohmann::json& row, std::size_t i, const std::string& where,
                 const std::string& field, double low, double high) {
    if (row[i].is_number())
        if (const auto number = row[i].get<double>(); number >= low && number <= high)
            return number;
    return number_in(row[i], where, fmt::format("{}[{}]", field, i), low, high);
}

std::array<double, 3> color_at(const nlohmann::json& row, std::size_t i, const std::string& where,
                               const std::string& field) {
    std::array<double, 3> color{};
    bool sensible = row[i].is_array() && row[i].size() == 3;
    for (std::size_t c = 0; sensible && c < 3; ++c) {
        color[c] = row[i][c].is_number() ? row[i][c].get<double>() : NAN;
        sensible = color[c] >= 0 && color[c] <= 1;
    }
    return sensible ? color : color_in(row[i], where, fmt::format("{}[{}]", field, i));
}

std::vector<double> places_of(const nlohmann::json& table, const char* key,
                              const std::string& where, double low) {
    const std::string field = fmt::format("table.{}", key);
    const nlohmann::json& json = member_of(table, key, where, "table", kTable);
    if (!json.is_array() || json.empty() || json.size() > TransferTable::kMostPlaces)
        refuse(where, fmt::format("{}: expected 1 to {} ascending numbers", field,
                                  TransferTable::kMostPlaces));
    std::vector<double> places;
    for (std::size_t i = 0; i < json.size(); ++i)
        places.push_back(number_at(json, i, where, field, low, 1e300));
    return places;
}

/// Calls each(row, its name) for the rows of a table: one a gradient, of one part a value.
template <class Each>
void for_rows(const nlohmann::json& json, const TransferTable& table, const std::string& where,
              const std::string& field, Each&& each) {
    const auto expect = [&](const nlohmann::json& list, std::size_t count, const std::string& name,
                            const char* what) {
        if (!list.is_array() || list.size() != count)
            refuse(where, fmt::format("{} has {}; expected {}, one for each {}", name,
                                      list.is_array() ? fmt::format("{}", list.size()) : "no list",
                                      count, what));
    };
    expect(json, table.gradients.size(), field, "gradient");
    for (std::size_t row = 0; row < json.size(); ++row) {
        const std::string name = fmt::format("{}[{}]", field, row);
        expect(json[row], table.values.size(), name, "value");
        each(json[row], name);
    }
}

TransferTable table_of(const nlohmann::json& json, const std::string& where, std::size_t points) {
    if (!json.is_object()) refuse(where, fmt::format("table: expected {}", kTable));
    expect_known(json, where, "table.", {"values", "gradients", "opacity", "color"});
    TransferTable table{.values = places_of(json, "values", where, -1e300),
                        .gradients = places_of(json, "gradients", where, 0),
                        .opacity = {}};
    for_rows(member_of(json, "opacity", where, "table", kTable), table, where, "table.opacity",
             [&](const nlohmann::json& row, const std::string& name) {
                 for (std::size_t i = 0; i < row.size(); ++i)
                     table.opacity.push_back(number_at(row, i, where, name, 0, 1));
             });
    if (json.contains("color"))
        for_rows(json["color"], table, where, "table.color",
                 [&](const nlohmann::json& row, const std::string& name) {
                     for (std::size_t i = 0; i < row.size(); ++i)
                         table.color.push_back(color_at(row, i, where, name));
                 });
    if (const std::string reason = no_table(table, points); !reason.empty())
        refuse(where, "table." + reason);
    return table;
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
    const bool has_table = json.is_object() && json.contains("table");
    if (!json.is_object() || (!json.contains("points") && !has_table) ||
        (json.contains("points") && (!json["points"].is_array() || json["points"].empty())))
        refuse(where, fmt::format("points is missing; expected {{\"points\": [{}]}}, a preset of "
                                  "ParaView or a volume property of Slicer",
                                  kPoint));
    expect_known(json, where, "",
                 {"points", "unit", "by_size", "values", "material", "gradient", "table"});
    TransferSpec read;
    Transfer& transfer = read.transfer;
    read.unit_given = json.contains("unit");
    if (read.unit_given) transfer.unit = number_in(json["unit"], where, "unit", 1e-12, 1e12);
    if (json.contains("by_size")) {
        if (!json["by_size"].is_boolean() || !read.unit_given)
            refuse(where, "by_size: expected true or false, and the unit of a patient's scan");
        read.by_size = json["by_size"].get<bool>();
    }
    if (json.contains("values")) read.values = values_of(json["values"], where);
    if (json.contains("material")) read.material = material_of(json["material"], where);
    if (json.contains("gradient")) transfer.edges = edges_of(json["gradient"], where);
    const nlohmann::json points = json.value("points", nlohmann::json::array());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const std::string field = fmt::format("points[{}]", i);
        transfer.points.push_back(point_of(points[i], where, field));
        if (i > 0 && transfer.points[i].value < transfer.points[i - 1].value)
            refuse(where,
                   fmt::format("{}.value is {}, less than {} before it; values must ascend", field,
                               transfer.points[i].value, transfer.points[i - 1].value));
    }
    if (!has_table) return read;
    if (!transfer.edges.empty())
        refuse(where, "a table tells opacities by gradient; leave out gradient, or table");
    if (read.values == TransferValues::labels)
        refuse(where, "labels have no gradients; leave out table");
    if (read.by_size) refuse(where, "a table's gradients are per length; leave out by_size");
    transfer.table = std::make_shared<const TransferTable>(
        table_of(json["table"], where, transfer.points.size()));
    return read;
}

}  // namespace edgewise::transfer
