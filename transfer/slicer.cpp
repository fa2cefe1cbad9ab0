#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "transfer/curves.hpp"
#include "transfer/fields.hpp"
#include "transfer/formats.hpp"

namespace edgewise::transfer {
namespace {

void expect_ascending(const Curve& curve, const std::string& where, const std::string& field) {
    for (std::size_t i = 1; i < curve.size(); ++i)
        if (curve[i].at < curve[i - 1].at)
            refuse(where, fmt::format("{}: point {} is at {}, less than {} before it; values must "
                                      "ascend",
                                      field, i, curve[i].at, curve[i - 1].at));
}

}  // namespace

TransferSpec property_of(const Curve& opacity, const Curve& gradient, const Curve& color,
                         double unit, const Material& material) {
    TransferSpec read;
    read.transfer = {joined(opacity, color), unit, {}};
    read.unit_given = true;
    read.material = material;
    if (!is_constant(gradient, 1))
        for (const Transfer::Point& point : joined(gradient, gradient))
            read.transfer.edges.push_back({std::max(0.0, point.value), point.opacity});
    return read;
}

namespace {

// ---- .vp.json

constexpr const char* kOpacityPoints =
    "{\"points\": [{\"x\": 300, \"y\": 0.5, \"midpoint\": 0.5, \"sharpness\": 0}]}";
constexpr const char* kColorPoints =
    "{\"points\": [{\"x\": 300, \"color\": [1, 0.9, 0.8], \"midpoint\": 0.5, \"sharpness\": 0}]}";

Curve curve_of(const nlohmann::json& json, const std::string& where, const std::string& field,
               bool colors) {
    const char* shape = colors ? kColorPoints : kOpacityPoints;
    if (!json.is_object() || !json.contains("points") || !json["points"].is_array() ||
        json["points"].empty() || json["points"].size() > kMostKnots)
        refuse(where, fmt::format("{}: expected 1 to {} points: {}", field, kMostKnots, shape));
    Curve curve;
    for (const nlohmann::json& point : json["points"]) {
        const std::string name = fmt::format("{}.points[{}]", field, curve.size());
        if (!point.is_object())
            refuse(where, fmt::format("{} is no point; expected {}", name, shape));
        const auto number = [&](const char* key, double low, double high) {
            return number_in(member_of(point, key, where, name, shape), where,
                             fmt::format("{}.{}", name, key), low, high);
        };
        Knot knot{number("x", -1e300, 1e300), {}};
        if (colors)
            knot.to =
                color_in(member_of(point, "color", where, name, shape), where, name + ".color");
        else
            knot.to = {number("y", 0, 1)};
        if (point.contains("midpoint")) knot.midpoint = number("midpoint", 0, 1);
        if (point.contains("sharpness")) knot.sharpness = number("sharpness", 0, 1);
        curve.push_back(knot);
    }
    expect_ascending(curve, where, field);
    return curve;
}

Material material_of(const nlohmann::json& component, const std::string& where,
                     const std::string& field) {
    Material material;
    if (!component.contains("lighting")) return material;
    const nlohmann::json& lighting = component["lighting"];
    const std::string name = field + ".lighting";
    if (!lighting.is_object())
        refuse(where, fmt::format("{}: expected ambient, diffuse, specular, specularPower", name));
    const auto take = [&](const char* key, double& into, double low, double high) {
        if (lighting.contains(key))
            into = number_in(lighting[key], where, fmt::format("{}.{}", name, key), low, high);
    };
    take("ambient", material.ambient, 0, 1);
    take("diffuse", material.diffuse, 0, 1);
    take("specular", material.specular, 0, 1);
    if (material.specular > 0) take("specularPower", material.exponent, 1, 1024);
    return material;
}

/// The only member of an array.
const nlohmann::json& only_of(const nlohmann::json& json, const char* key, const std::string& where,
                              const std::string& field) {
    const auto found = json.find(key);
    if (found == json.end() || !found->is_array() || found->size() != 1 || !(*found)[0].is_object())
        refuse(where, fmt::format("{}: {} given; expected one", field,
                                  found != json.end() && found->is_array() ? found->size() : 0));
    return (*found)[0];
}

// ---- .vp

constexpr const char* kLines[] = {"interpolation", "shade", "diffuse",        "ambient",
                                  "specular",      "power", "scalar opacity", "gradient opacity",
                                  "color transfer"};

std::vector<std::string_view> lines_of(std::string_view text) {
    std::vector<std::string_view> lines;
    while (!text.empty() && lines.size() < std::size(kLines)) {
        const std::size_t end = text.find('\n');
        std::string_view line = text.substr(0, end);
        if (line.ends_with('\r')) line.remove_suffix(1);
        lines.push_back(line);
        text = end == text.npos ? "" : text.substr(end + 1);
    }
    return lines;
}

std::string field_of(std::size_t line) {
    return fmt::format("line {} ({})", line + 1, kLines[line]);
}

}  // namespace

std::vector<double> numbers_in(std::string_view line, const std::string& where,
                               const std::string& field) {
    constexpr std::size_t kMost = 1 + 4 * kMostKnots;
    constexpr const char* kBlanks = " \t";
    std::vector<double> numbers;
    for (std::size_t at = line.find_first_not_of(kBlanks); at != line.npos;
         at = line.find_first_not_of(kBlanks, at)) {
        const std::size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
        const std::string_view word = line.substr(at, end - at);
        double number = 0;
        const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), number);
        if (error != std::errc() || stop != word.data() + word.size() || !std::isfinite(number))
            refuse(where,
                   fmt::format("{}: '{}' is no number", field, shortened(std::string(word))));
        if (numbers.size() == kMost)
            refuse(where, fmt::format("{}: expected at most {} points", field, kMostKnots));
        numbers.push_back(number);
        at = end;
    }
    return numbers;
}

Curve listed_curve(std::string_view line, const std::string& where, const std::string& field,
                   std::size_t parts) {
    const std::vector<double> numbers = numbers_in(line, where, field);
    const std::size_t size = 1 + parts;
    const char* shape = parts == 1 ? "value and opacity" : "value, red, green and blue";
    if (numbers.size() < 1 + size || (numbers.size() - 1) % size != 0 ||
        numbers[0] != static_cast<double>(numbers.size() - 1))
        refuse(where,
               fmt::format("{}: {} given, then {} numbers; expected how many numbers "
                           "follow, then {} of each point",
                           field, numbers.empty() ? "nothing" : fmt::format("{}", numbers[0]),
                           numbers.empty() ? 0 : numbers.size() - 1, shape));
    Curve curve;
    for (std::size_t i = 1; i < numbers.size(); i += size) {
        Knot knot{numbers[i], {}};
        for (std::size_t c = 0; c < parts; ++c) {
            knot.to[c] = numbers[i + 1 + c];
            if (!(knot.to[c] >= 0 && knot.to[c] <= 1))
                refuse(where,
                       fmt::format("{}: {} at {} is not from 0 to 1", field, knot.to[c], knot.at));
        }
        curve.push_back(knot);
    }
    expect_ascending(curve, where, field);
    return curve;
}

bool is_slicer(const nlohmann::json& json) {
    return json.is_object() && json.contains("volumeProperties");
}

TransferSpec slicer_transfer(const nlohmann::json& json, const std::string& where) {
    const nlohmann::json& property = only_of(json, "volumeProperties", where, "volumeProperties");
    const nlohmann::json& component =
        only_of(property, "components", where, "volumeProperties[0].components");
    const std::string field = "components[0]";
    const auto curve = [&](const char* key, bool colors) {
        const char* shape = colors ? kColorPoints : kOpacityPoints;
        return curve_of(member_of(component, key, where, field, shape), where,
                        fmt::format("{}.{}", field, key), colors);
    };
    const Curve opacity = curve("scalarOpacity", false), color = curve("rgbTransferFunction", true);
    const bool disabled = component.value("disableGradientOpacity", nlohmann::json()) == true;
    const bool has_gradient = component.contains("gradientOpacity") && !disabled;
    const Curve gradient = has_gradient ? curve("gradientOpacity", false) : Curve{};
    double unit = 1;
    if (component.contains("scalarOpacityUnitDistance"))
        unit = number_in(component["scalarOpacityUnitDistance"], where,
                         field + ".scalarOpacityUnitDistance", 1e-12, 1e12);
    return property_of(opacity, gradient, color, unit, material_of(component, where, field));
}

bool is_slicer_text(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    return first != text.npos && text[first] >= '0' && text[first] <= '9';
}

TransferSpec slicer_text_transfer(std::string_view text, const std::string& where) {
    const std::vector<std::string_view> lines = lines_of(text);
    if (lines.size() < std::size(kLines))
        refuse(where, fmt::format("ends after line {}; a volume property of Slicer has 9: {}",
                                  lines.size(), fmt::join(kLines, ", ")));
    const auto number = [&](std::size_t line, double low, double high) {
        const std::vector<double> numbers = numbers_in(lines[line], where, field_of(line));
        if (numbers.size() != 1 || !(numbers[0] >= low && numbers[0] <= high))
            refuse(where,
                   fmt::format("{}: '{}' given; expected a number from {} to {}", field_of(line),
                               shortened(std::string(lines[line])), low, high));
        return numbers[0];
    };
    number(0, 0, 2), number(1, 0, 1);
    Material material{
        .ambient = number(3, 0, 1), .diffuse = number(2, 0, 1), .specular = number(4, 0, 1)};
    if (material.specular > 0) material.exponent = number(5, 1, 1024);
    const Curve opacity = listed_curve(lines[6], where, field_of(6), 1);
    const bool has_gradient = lines[7].find_first_not_of(" \t") != std::string_view::npos;
    const Curve gradient = has_gradient ? listed_curve(lines[7], where, field_of(7), 1) : Curve{};
    return property_of(opacity, gradient, listed_curve(lines[8], where, field_of(8), 3), 1,
                       material);
}

}  // namespace edgewise::transfer
