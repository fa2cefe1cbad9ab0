// OME-Zarr (OME-NGFF 0.1 to 0.5) and plain arrays of Zarr 2 and 3 in a folder: an array is cut into
// chunks, each a file of its own; an image is the same array at several resolutions.
// Moore et al., OME-Zarr: a cloud-optimized bioimaging file format, Histochem. Cell Biol. 160
// (2023).

#include "io/zarr.hpp"

#include <filesystem>
#include <fmt/format.h>
#include <utility>

#include "graph/errors.hpp"
#include "io/channel_colours.hpp"
#include "io/text.hpp"
#include "io/zarr_array.hpp"
#include "io/zarr_image.hpp"
#include "io/zarr_reader.hpp"

namespace edgewise::store {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// The level's array, as an image of one resolution would have it.
Header described(const std::string& path, const ZarrImage& image, std::size_t index) {
    const ZarrLevel& level = image.levels[index];
    const ZarrNode node = zarr_node_of(level.folder);
    if (node.array.is_null()) refuse(path, fmt::format("{}: holds no array", level.folder));
    ZarrArray array = zarr_array_of(level.folder, node);
    if (array.shape.size() != image.axes.size())
        refuse(path, fmt::format("{} axes are named, and the array has {}", image.axes.size(),
                                 array.shape.size()));
    Header header;
    header.file = path;
    header.format = "OME-Zarr";
    Stored stored;
    stored.type = array.type;
    stored.wide = array.wide;
    for (std::size_t i = array.shape.size(); i-- > 0;)
        stored.axes.push_back({image.axes[i].kind, array.shape[i]});
    take_axes(header, stored);
    header.volume = header.extent.z > 1;
    take_lengths(header, image, level);
    header.reading_bytes = 4 * array.chunk_bytes() + (1 << 20);
    auto reader = std::make_shared<ZarrReader>(std::move(array), image.axes);
    reader->narrow(header);
    header.reader = std::move(reader);
    return header;
}

/// Images that lie side by side in a folder, as converters of microscopes write them.
std::string one_of(const std::string& path, const Selection& pick) {
    std::vector<std::string> all;
    while (fs::is_directory(path + "/" + std::to_string(all.size())))
        all.push_back(path + "/" + std::to_string(all.size()));
    if (all.empty()) refuse(path, "holds no image: folder 0 is missing");
    if (all.size() == 1 && !pick.series) return all[0];
    const auto chosen = pick.series ? to_integer(*pick.series) : std::nullopt;
    if (!chosen || *chosen < 0 || *chosen >= static_cast<std::int64_t>(all.size()))
        throw RequestError(fmt::format("{}: holds {} images, choose one with --series 0 ... {}",
                                       path, all.size(), all.size() - 1));
    return all[static_cast<std::size_t>(*chosen)];
}

/// The image or array that is meant, and its folder.
std::pair<ZarrNode, std::string> found_in(const std::string& folder, const Selection& pick) {
    std::string path = folder;
    while (path.size() > 1 && path.ends_with('/')) path.pop_back();
    ZarrNode node = zarr_node_of(path);
    if (node.has("plate") || node.has("well"))
        refuse(folder, "is a plate or a well of many images: name the folder of one");
    if (node.array.is_null() && !node.has("multiscales")) {
        path = one_of(path, pick);
        node = zarr_node_of(path);
    }
    return {std::move(node), std::move(path)};
}

Header inspected(const std::string& folder, const Selection& pick) {
    const auto [node, path] = found_in(folder, pick);
    ZarrImage image;
    if (!node.array.is_null()) {
        const Json shape = node.array.value("shape", Json::array());
        image = zarr_image_of_array(path, shape.size());
    } else if (node.has("multiscales")) {
        image = zarr_image_of(path, node.attributes["multiscales"]);
    } else {
        refuse(folder, "is a Zarr group without an image: field 'multiscales' is missing");
    }
    const std::size_t count = image.levels.size();
    const int level = pick.level.value_or(0);
    if (count == 1 && level != 0)
        throw RequestError(
            fmt::format("{}: --level {}: it holds one resolution, 0", folder, level));
    if (level < 0 || static_cast<std::size_t>(level) >= count)
        throw RequestError(
            fmt::format("{}: --level {}: it holds resolutions 0 to {}", folder, level, count - 1));
    Header header = described(path, image, static_cast<std::size_t>(level));
    header.file = folder;
    header.labels = node.has("image-label");
    header.level = level;
    for (const ZarrLevel& each : image.levels) {
        const ZarrNode array = zarr_node_of(each.folder);
        if (array.array.is_null()) refuse(folder, fmt::format("{}: holds no array", each.folder));
        const std::vector<std::int64_t> shape = zarr_array_of(each.folder, array).shape;
        if (shape.size() == image.axes.size())
            header.levels.push_back(extent_of(image.axes, shape));
    }
    return header;
}

}  // namespace

bool is_zarr(const std::string& folder) {
    for (const char* name : {".zattrs", ".zgroup", ".zarray", kZarrVersion3})
        if (fs::exists(folder + "/" + name)) return true;
    return false;
}

std::vector<std::optional<Colour>> zarr_colours(const std::string& folder, const Selection& pick) {
    std::vector<std::optional<Colour>> colours;
    try {
        const auto [node, path] = found_in(folder, pick);
        if (!node.has("omero")) return colours;
        for (const Json& channel : node.attributes["omero"].value("channels", Json::array()))
            colours.push_back(colour_of(channel.value("color", "")));
    } catch (const Json::exception&) {
        colours.clear();  // it says none that can be read
    }
    return colours;
}

Header inspect_zarr(const std::string& folder, const Selection& pick) {
    try {
        return inspected(folder, pick);
    } catch (const Json::exception& error) {
        // A field of another type than expected.
        refuse(folder, fmt::format("its description: {}", shown(error.what())));
    }
}

}  // namespace edgewise::store
