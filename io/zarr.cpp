// OME-Zarr (OME-NGFF 0.1 to 0.5) and plain arrays of Zarr 2 and 3, in a folder or a ZIP file: an
// array is cut into chunks, each a file of its own or together in shards; an image is the same
// array at several resolutions. Moore et al., OME-Zarr: a cloud-optimized bioimaging file format,
// Histochem. Cell Biol. 160 (2023).

#include "io/zarr.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <utility>

#include "graph/errors.hpp"
#include "io/channel_colours.hpp"
#include "io/text.hpp"
#include "io/zarr_array.hpp"
#include "io/zarr_group.hpp"
#include "io/zarr_image.hpp"
#include "io/zarr_reader.hpp"
#include "io/zarr_store.hpp"

namespace edgewise::store {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Colours of labels: {"colors": [{"label-value": 1, "rgba": [255, 0, 0, 255]}]}.
std::vector<Segment> zarr_segments_of(const Json& labels) {
    std::vector<Segment> segments;
    const auto colours = labels.is_object() ? labels.find("colors") : labels.end();
    if (colours == labels.end() || !colours->is_array()) return segments;
    for (const Json& colour : *colours) {
        const Json of = colour.is_object() ? colour : Json::object();
        const Json label = of.value("label-value", Json()), rgba = of.value("rgba", Json());
        if (!label.is_number_integer() || !rgba.is_array() || rgba.size() < 3) continue;
        std::array<double, 3> color{};
        bool whole = true;
        for (std::size_t i = 0; i < 3; ++i) {
            whole = whole && rgba[i].is_number_integer();
            color[i] = whole ? std::clamp(rgba[i].get<double>() / 255, 0.0, 1.0) : 0;
        }
        if (whole) segments.push_back({label.get<std::int64_t>(), "", color, {}});
    }
    return segments;
}

using StorePointer = std::shared_ptr<const ZarrStore>;

/// An image of a hierarchy.
struct OpenedZarr {
    StorePointer store;
    ZarrPlace place;
};

OpenedZarr opened_zarr(const std::string& path, const Selection& pick) {
    auto [store, key] = open_zarr(path);
    ZarrPlace place = zarr_place_of(*store, key, path, pick);
    return {std::move(store), std::move(place)};
}

/// Memory that reading takes beside the samples: a chunk packed and unpacked for some threads, and
/// files that must be unpacked as a whole.
std::size_t reading_bytes_of(const ZarrArray& array) {
    std::size_t bytes = 4 * array.chunk_bytes() + (1 << 20);
    if (array.shards) bytes += 32 * array.chunks_in_file();
    if (array.store->unpacks()) bytes += array.chunk_bytes() * array.chunks_in_file();
    return bytes;
}

/// The level's array, as an image of one resolution would have it.
Header level_header(const std::string& path, const StorePointer& store, const ZarrImage& image,
                    std::size_t index, bool labels) {
    const ZarrLevel& level = image.levels[index];
    const ZarrNode node = zarr_node_of(*store, level.key);
    if (node.array.is_null())
        refuse(path, fmt::format("{}: holds no array", store->name_of(level.key)));
    ZarrArray array = zarr_array_of(store, level.key, node);
    if (array.shape.size() != image.axes.size())
        refuse(path, fmt::format("{} axes are named, and the array has {}", image.axes.size(),
                                 array.shape.size()));
    Header header;
    header.file = path;
    header.format = "OME-Zarr";
    header.labels = labels;
    Stored stored;
    stored.type = array.type;
    stored.wide = array.wide;
    for (std::size_t i = array.shape.size(); i-- > 0;)
        stored.axes.push_back({image.axes[i].kind, array.shape[i]});
    take_axes(header, stored);
    header.volume = header.extent.z > 1;
    take_lengths(header, image, level);
    header.reading_bytes = reading_bytes_of(array);
    header.integers = stored.wide;
    header.reader = std::make_shared<const ZarrReader>(std::move(array), image.axes);
    return header;
}

Header inspected(const std::string& path, const Selection& pick) {
    const auto [store, place] = opened_zarr(path, pick);
    const ZarrNode& node = place.node;
    const ZarrImage image =
        node.array.is_null() ? zarr_image_of(*store, place.key, node.attributes["multiscales"])
                             : zarr_image_of_array(*store, place.key,
                                                   node.array.value("shape", Json::array()).size());
    const std::size_t count = image.levels.size();
    const int level = pick.level.value_or(0);
    if (count == 1 && level != 0)
        throw RequestError(message("{}: @level({}): it holds one resolution, 0", path, level));
    if (level < 0 || static_cast<std::size_t>(level) >= count)
        throw RequestError(
            message("{}: @level({}): it holds resolutions 0 to {}", path, level, count - 1));
    Header header =
        level_header(path, store, image, static_cast<std::size_t>(level), node.has("image-label"));
    if (header.labels) header.segments = zarr_segments_of(node.attributes["image-label"]);
    header.level = level;
    for (const ZarrLevel& each : image.levels) {
        const ZarrNode array = zarr_node_of(*store, each.key);
        if (array.array.is_null())
            refuse(path, fmt::format("{}: holds no array", store->name_of(each.key)));
        const std::vector<std::int64_t> shape = zarr_array_of(store, each.key, array).shape;
        if (shape.size() == image.axes.size())
            header.levels.push_back(extent_of(image.axes, shape));
    }
    return header;
}

}  // namespace

bool is_zarr(const std::string& path) {
    std::error_code none;
    if (!fs::is_directory(path, none)) return into_zip(path).has_value();
    for (const char* name : {".zattrs", ".zgroup", ".zarray", kZarrVersion3})
        if (fs::exists(path + "/" + name, none)) return true;
    return false;
}

std::vector<std::optional<Colour>> zarr_colours(const std::string& path, const Selection& pick) {
    std::vector<std::optional<Colour>> colours;
    try {
        const ZarrNode node = opened_zarr(path, pick).place.node;
        if (!node.has("omero")) return colours;
        for (const Json& channel : node.attributes["omero"].value("channels", Json::array()))
            colours.push_back(colour_of(channel.value("color", "")));
    } catch (const Json::exception&) {
        colours.clear();  // it says none that can be read
    }
    return colours;
}

std::vector<std::string> zarr_channel_names(const std::string& path, const Selection& pick) {
    std::vector<std::string> names;
    try {
        const ZarrNode node = opened_zarr(path, pick).place.node;
        if (!node.has("omero")) return names;
        for (const Json& channel : node.attributes["omero"].value("channels", Json::array()))
            names.push_back(channel.value("label", ""));
    } catch (const Json::exception&) {
        names.clear();  // it says none that can be read
    }
    return names;
}

Header inspect_zarr(const std::string& path, const Selection& pick) {
    try {
        return inspected(path, pick);
    } catch (const Json::exception& error) {
        // A field of another type than expected.
        refuse(path, fmt::format("its description: {}", shown(error.what())));
    }
}

}  // namespace edgewise::store
