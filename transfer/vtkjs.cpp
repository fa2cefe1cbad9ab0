// Volume presets of vtk.js, as paraview-glance, cornerstone and OHIF have them: the nine lines of
// Slicer's .vp as members of an object, all of them texts.

#include <array>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <string>

#include "transfer/curves.hpp"
#include "transfer/fields.hpp"
#include "transfer/formats.hpp"

namespace edgewise::transfer {
namespace {

constexpr const char* kShape =
    "\"scalarOpacity\": \"4 100 0 300 0.8\", \"colorTransfer\": \"8 100 0 0 0 300 1 0.9 0.8\"";

/// A member that is a text, or a number alone.
std::string text_in(const nlohmann::json& json, const char* key, const std::string& where) {
    const nlohmann::json& member = member_of(json, key, where, "a volume preset of vtk.js", kShape);
    if (member.is_number()) return fmt::format("{}", member.get<double>());
    if (!member.is_string())
        refuse(where, fmt::format("{} is {}; expected a text of numbers, as {}", key,
                                  shortened(member.dump()), kShape));
    return member.get<std::string>();
}

/// vtk.js does not look at the number that says how many follow, and some presets have a wrong one.
Curve curve_in(const nlohmann::json& json, const char* key, std::size_t parts,
               const std::string& where, std::vector<Message>& warnings) {
    const std::string text = text_in(json, key, where);
    const std::vector<double> numbers = numbers_in(text, where, key);
    const std::size_t follow = numbers.empty() ? 0 : numbers.size() - 1;
    if (follow == 0 || follow % (1 + parts) != 0 || numbers[0] == static_cast<double>(follow))
        return listed_curve(text, where, key, parts);
    warnings.push_back(fmt::format("{}: {} says that {} numbers follow, and {} do", where, key,
                                   numbers[0], follow));
    std::string counted = fmt::format("{}", follow);
    for (std::size_t i = 1; i < numbers.size(); ++i) counted += fmt::format(" {}", numbers[i]);
    return listed_curve(counted, where, key, parts);
}

double share_in(const nlohmann::json& json, const char* key, const std::string& where,
                double missing, double low, double high) {
    if (!json.contains(key)) return missing;
    const std::string text = text_in(json, key, where);
    const std::vector<double> numbers = numbers_in(text, where, key);
    if (numbers.size() != 1 || !(numbers[0] >= low && numbers[0] <= high))
        refuse(where, fmt::format("{}: '{}' given; expected a number from {} to {}", key,
                                  shortened(text), low, high));
    return numbers[0];
}

}  // namespace

bool is_vtkjs(const nlohmann::json& json) {
    return json.is_object() && (json.contains("colorTransfer") || json.contains("scalarOpacity"));
}

TransferSpec vtkjs_transfer(const nlohmann::json& json, const std::string& where) {
    std::vector<Message> warnings;
    const Curve opacity = curve_in(json, "scalarOpacity", 1, where, warnings);
    const Curve color = curve_in(json, "colorTransfer", 3, where, warnings);
    const Curve gradient = json.contains("gradientOpacity")
                               ? curve_in(json, "gradientOpacity", 1, where, warnings)
                               : Curve{};
    Material material;
    material.ambient = share_in(json, "ambient", where, material.ambient, 0, 1);
    material.diffuse = share_in(json, "diffuse", where, material.diffuse, 0, 1);
    material.specular = share_in(json, "specular", where, material.specular, 0, 1);
    if (material.specular > 0)
        material.exponent = share_in(json, "specularPower", where, material.exponent, 1, 1024);
    // vtk.js has opacities for each unit of length where nobody says another one.
    TransferSpec read = property_of(opacity, gradient, color, 1, material);
    read.warnings = std::move(warnings);
    return read;
}

}  // namespace edgewise::transfer
