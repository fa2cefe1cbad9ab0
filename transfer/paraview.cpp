#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <string>

#include "transfer/curves.hpp"
#include "transfer/fields.hpp"
#include "transfer/formats.hpp"

namespace edgewise::transfer {
namespace {

constexpr const char* kColors = "\"RGBPoints\": [x, red, green, blue, ...]";
constexpr const char* kOpacities = "\"Points\": [x, opacity, midpoint, sharpness, ...]";

/// Numbers in fours, each a knot.
/// @param shape  what is expected
Curve curve_of(const nlohmann::json& numbers, const std::string& where, const char* field,
               const char* shape, bool colors) {
    if (!numbers.is_array() || numbers.empty() || numbers.size() % 4 != 0)
        refuse(where, fmt::format("{} holds {} numbers; expected fours: {}", field,
                                  numbers.is_array() ? numbers.size() : 0, shape));
    if (numbers.size() > 4 * kMostKnots)
        refuse(where, fmt::format("{} holds {} points; expected at most {}", field,
                                  numbers.size() / 4, kMostKnots));
    const auto number = [&](std::size_t i, double low, double high) {
        return number_in(numbers[i], where, fmt::format("{}[{}]", field, i), low, high);
    };
    Curve curve;
    for (std::size_t i = 0; i < numbers.size(); i += 4) {
        Knot knot{number(i, -1e300, 1e300), {number(i + 1, 0, 1)}};
        if (colors)
            knot.to = {knot.to[0], number(i + 2, 0, 1), number(i + 3, 0, 1)};
        else
            knot.midpoint = number(i + 2, 0, 1), knot.sharpness = number(i + 3, 0, 1);
        if (!curve.empty() && knot.at < curve.back().at)
            refuse(where, fmt::format("{}[{}] is {}, less than {} before it; x must ascend", field,
                                      i, knot.at, curve.back().at));
        curve.push_back(knot);
    }
    return curve;
}

const nlohmann::json& preset_in(const nlohmann::json& json, const std::string& where) {
    if (!json.is_array()) return json;
    if (json.size() != 1)
        refuse(where, fmt::format("holds {} presets; expected one: export it alone", json.size()));
    return json[0];
}

/// What a picture would show otherwise than ParaView does.
std::vector<Message> left_out(const nlohmann::json& preset, const std::string& where) {
    std::vector<Message> warnings;
    if (preset.contains("ColorSpace") && preset["ColorSpace"] != "RGB")
        warnings.push_back(
            fmt::format("{}: ColorSpace is {}: colours between its points are mixed in RGB", where,
                        shortened(preset["ColorSpace"].dump())));
    const auto log = preset.find("UseLogScale");
    if (log != preset.end() && *log != false && *log != 0)
        warnings.push_back(where + ": UseLogScale is left out: the scale is linear");
    return warnings;
}

}  // namespace

bool is_paraview(const nlohmann::json& json) {
    const nlohmann::json& preset = json.is_array() && !json.empty() ? json[0] : json;
    if (json.is_array() && !json.empty()) return true;
    return preset.is_object() && (preset.contains("RGBPoints") || preset.contains("ColorSpace") ||
                                  preset.contains("IndexedColors") || preset.contains("Points"));
}

TransferSpec paraview_transfer(const nlohmann::json& json, const std::string& where) {
    const nlohmann::json& preset = preset_in(json, where);
    if (!preset.is_object() || !preset.contains("RGBPoints"))
        refuse(where, fmt::format("has no RGBPoints{}; expected {}",
                                  preset.is_object() && preset.contains("IndexedColors")
                                      ? " (IndexedColors are of categories, not of values)"
                                      : "",
                                  kColors));
    const Curve colors = curve_of(preset["RGBPoints"], where, "RGBPoints", kColors, true);
    Curve opacities;
    if (preset.contains("Points") && !preset["Points"].is_null()) {
        opacities = curve_of(preset["Points"], where, "Points", kOpacities, false);
    } else {
        // As without any transfer function.
        constexpr double kMostOpacity = 0.05;
        opacities = {{colors.front().at, {0}}, {colors.back().at, {kMostOpacity}}};
    }
    TransferSpec read;
    read.transfer.points = joined(opacities, colors);
    read.warnings = left_out(preset, where);
    const double low = std::min(colors.front().at, opacities.front().at);
    const double high = std::max(colors.back().at, opacities.back().at);
    // Presets that come with ParaView run over one of these; it stretches them over the data.
    if (high != 1 || (low != 0 && low != -1)) return read;
    read.values = TransferValues::range;
    for (Transfer::Point& point : read.transfer.points)
        point.value = (point.value - low) / (high - low);
    return read;
}

}  // namespace edgewise::transfer
