#include "io/zarr_image.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fmt/format.h>
#include <utility>

#include "graph/errors.hpp"
#include "io/geometry.hpp"
#include "io/text.hpp"
#include "io/zarr_array.hpp"

namespace edgewise::store {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Axes that nobody names, as version 0.1 and 0.2 have them.
std::vector<ZarrImage::Named> usual_axes(const std::string& folder, std::size_t count) {
    const std::vector<Axis::Kind> kinds[] = {
        {Axis::x},
        {Axis::y, Axis::x},
        {Axis::z, Axis::y, Axis::x},
        {Axis::channel, Axis::z, Axis::y, Axis::x},
        {Axis::time, Axis::channel, Axis::z, Axis::y, Axis::x}};
    if (count < 1 || count > std::size(kinds))
        refuse(folder, fmt::format("{} axes are not supported", count));
    std::vector<ZarrImage::Named> axes;
    for (const Axis::Kind kind : kinds[count - 1]) axes.push_back({kind, ""});
    return axes;
}

std::vector<ZarrImage::Named> axes_of(const std::string& folder, const Json& json) {
    const std::pair<const char*, Axis::Kind> names[] = {
        {"x", Axis::x}, {"y", Axis::y}, {"z", Axis::z}, {"c", Axis::channel}, {"t", Axis::time}};
    std::vector<ZarrImage::Named> axes;
    for (const Json& axis : json) {
        // Version 0.3 has names alone.
        const bool plain = axis.is_string();
        const std::string name = plain              ? axis.get<std::string>()
                                 : axis.is_object() ? axis.value("name", "")
                                                    : "";
        const std::string type = plain || !axis.is_object() ? "" : axis.value("type", "");
        const auto found = std::find_if(std::begin(names), std::end(names), [&](const auto& known) {
            return lower(name) == known.first ||
                   (type == "channel" && known.second == Axis::channel) ||
                   (type == "time" && known.second == Axis::time);
        });
        if (found == std::end(names))
            refuse(folder, fmt::format("field 'axes': '{}' is not known; expected x, y, z, c or t",
                                       shown(name)));
        axes.push_back({found->second, plain ? "" : axis.value("unit", "")});
    }
    return axes;
}

/// Numbers of one transform of `scale` or `translation`, one an axis.
std::vector<double> numbers_in(const std::string& folder, const Json& json, const std::string& kind,
                               std::size_t axes) {
    const Json list = json.value(kind, Json());
    std::vector<double> numbers;
    for (const Json& number : list) {
        if (!number.is_number())
            refuse(folder,
                   fmt::format("field 'coordinateTransformations': {} holds no numbers", kind));
        numbers.push_back(number.get<double>());
    }
    if (numbers.size() != axes)
        refuse(folder,
               fmt::format("field 'coordinateTransformations': {} has {} numbers for {} axes", kind,
                           numbers.size(), axes));
    return numbers;
}

/// Transforms one after another: places are scale * index + move.
void take_transforms(const std::string& folder, const Json& transforms, ZarrLevel& level) {
    if (!transforms.is_array()) return;
    for (const Json& transform : transforms) {
        const std::string type = transform.is_object() ? transform.value("type", "") : "";
        if (type == "identity") continue;
        if (type != "scale" && type != "translation")
            refuse(folder, fmt::format("field 'coordinateTransformations': '{}' is not supported; "
                                       "expected scale or translation",
                                       shown(type)));
        const std::vector<double> numbers = numbers_in(folder, transform, type, level.scale.size());
        for (std::size_t axis = 0; axis < numbers.size(); ++axis) {
            if (type == "scale") {
                level.scale[axis] *= numbers[axis];
                level.move[axis] *= numbers[axis];
            } else {
                level.move[axis] += numbers[axis];
            }
        }
    }
}

/// A folder that the metadata name, inside their own.
std::string inside(const ZarrStore& store, const std::string& key, const std::string& name) {
    const fs::path path(name);
    const bool climbs =
        std::any_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
    if (name.empty() || path.is_absolute() || climbs)
        refuse(store.name_of(key),
               fmt::format("field 'path': {} is not a folder inside", in_quotes(name)));
    const std::string whole = zarr_key(key, name);
    if (!store.has_folder(whole))
        refuse(store.name_of(key), fmt::format("field 'path': {} is missing", in_quotes(name)));
    return whole;
}

}  // namespace

ZarrImage zarr_image_of_array(const ZarrStore& store, const std::string& key, std::size_t axes) {
    ZarrImage image;
    image.axes = usual_axes(store.name_of(key), axes);
    image.levels.push_back({key, std::vector<double>(axes, 1), std::vector<double>(axes, 0)});
    return image;
}

ZarrImage zarr_image_of(const ZarrStore& store, const std::string& key, const Json& multiscales) {
    const std::string folder = store.name_of(key);
    if (!multiscales.is_array() || multiscales.empty() || !multiscales[0].is_object())
        refuse(folder, "field 'multiscales': expected a list of images");
    const Json& first = multiscales[0];
    const Json datasets = first.value("datasets", Json::array());
    if (!datasets.is_array() || datasets.empty()) refuse(folder, "field 'datasets': is empty");
    ZarrImage image;
    if (first.contains("axes")) image.axes = axes_of(folder, first["axes"]);
    for (const Json& dataset : datasets) {
        ZarrLevel level;
        level.key = inside(store, key, dataset.is_object() ? dataset.value("path", "") : "");
        if (image.axes.empty()) {
            const Json shape = zarr_node_of(store, level.key).array.value("shape", Json::array());
            image.axes = usual_axes(folder, shape.size());
        }
        level.scale.assign(image.axes.size(), 1);
        level.move.assign(image.axes.size(), 0);
        take_transforms(folder, dataset.value("coordinateTransformations", Json()), level);
        take_transforms(folder, first.value("coordinateTransformations", Json()), level);
        image.levels.push_back(std::move(level));
    }
    return image;
}

Extent extent_of(const std::vector<ZarrImage::Named>& axes,
                 const std::vector<std::int64_t>& shape) {
    Extent extent{1, 1, 1};
    for (std::size_t i = 0; i < axes.size(); ++i)
        if (axes[i].kind <= Axis::z) extent[axes[i].kind] = shape[i];
    return extent;
}

void take_lengths(Header& header, const ZarrImage& image, const ZarrLevel& level) {
    constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
    std::array<const ZarrImage::Named*, 3> named{};
    std::array<std::size_t, 3> place{};
    for (std::size_t i = 0; i < image.axes.size(); ++i)
        if (image.axes[i].kind <= Axis::z) {
            named[static_cast<std::size_t>(image.axes[i].kind)] = &image.axes[i];
            place[static_cast<std::size_t>(image.axes[i].kind)] = i;
        }
    // Of x where it has one: converters leave out what a microscope does not say, that of z first.
    const ZarrImage::Named* first = nullptr;
    for (const ZarrImage::Named* axis : named)
        if (!first && axis && millimetres(axis->unit) > 0) first = axis;
    const double usual = first ? millimetres(first->unit) : 1;
    for (std::size_t k = 0; k < 3; ++k) {
        if (!named[k]) continue;
        const std::string& unit = named[k]->unit;
        const bool known = millimetres(unit) > 0;
        if (!known && (first || !unit.empty()))
            header.warnings.push_back(fmt::format(
                "{}: field 'axes': {}{}", header.file,
                unit.empty()
                    ? fmt::format("{} has no unit", kAxes[k])
                    : fmt::format("the unit {} of {} is not known", in_quotes(unit), kAxes[k]),
                first ? fmt::format("; taken as {}", in_quotes(first->unit)) : ""));
        const double factor = known ? millimetres(unit) : usual;
        header.spacing[k] = without_noise(level.scale[place[k]] * factor);
        header.origin[k] = level.move[place[k]] * factor;
    }
    if (first) header.unit = "mm", header.file_unit = usual;
    check_spacing(header, "scale");
}

}  // namespace edgewise::store
