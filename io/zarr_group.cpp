#include "io/zarr_group.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <utility>
#include <vector>

#include "graph/errors.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

using Json = nlohmann::json;

/// Folders of folders: a plate's row, well, image.
constexpr int kDeepestGroup = 8;
constexpr std::size_t kMostListed = 12;

std::string quoted_list(const std::vector<std::string>& names) {
    std::string text;
    for (std::size_t i = 0; i < std::min(names.size(), kMostListed); ++i)
        text += (text.empty() ? "" : ", ") + in_quotes(names[i]);
    if (names.size() > kMostListed) text += fmt::format(" and {} more", names.size() - kMostListed);
    return text;
}

/// What a group holds, by kind.
struct Content {
    std::vector<std::string> images, arrays, groups, labels;
};

Content content_of(const ZarrStore& store, const std::string& key) {
    Content content;
    for (const std::string& name : store.folders(key)) {
        const std::string child = zarr_key(key, name);
        if (!is_zarr_node(store, child)) continue;
        const ZarrNode node = zarr_node_of(store, child);
        if (!node.array.is_null())
            content.arrays.push_back(name);
        else if (node.has("multiscales"))
            content.images.push_back(name);
        else if (node.has("labels") && node.attributes["labels"].is_array())
            for (const Json& label : node.attributes["labels"])
                content.labels.push_back(name + "/" +
                                         (label.is_string() ? label.get<std::string>() : ""));
        else
            content.groups.push_back(name);
    }
    return content;
}

/// Texts of a field of the objects in a list, as `wells[].path`.
std::vector<std::string> paths_in(const Json& about, const char* list) {
    std::vector<std::string> paths;
    if (!about.is_object()) return paths;
    for (const Json& each : about.value(list, Json::array()))
        if (each.is_object()) paths.push_back(each.value("path", ""));
    return paths;
}

std::string text_of(const Content& content) {
    std::string text;
    for (const auto& [kind, names] :
         {std::pair("images", content.images), std::pair("arrays", content.arrays),
          std::pair("labels", content.labels), std::pair("groups", content.groups)})
        if (!names.empty())
            text += fmt::format("{}{} {}", text.empty() ? "" : "; ", kind, quoted_list(names));
    return text;
}

class Search {
 public:
    Search(const ZarrStore& store, const std::string& path) : store_(store), path_(path) {}

    ZarrPlace place(std::string key, std::optional<std::string> series) const {
        for (int deep = 0; deep < kDeepestGroup; ++deep) {
            ZarrNode node = zarr_node_of(store_, key);
            const bool many = node.has("plate") || node.has("well");
            const bool one = !node.array.is_null() || (node.has("multiscales") && !many);
            if (one) return {std::move(node), std::move(key)};
            const std::string next = one_of(key, node, series);
            key = zarr_key(key, next);
            series.reset();
        }
        refuse(path_, "is a Zarr hierarchy without an image near its top");
    }

 private:
    /// Which of the things in a group, by its path there.
    std::string one_of(const std::string& key, const ZarrNode& node,
                       const std::optional<std::string>& series) const {
        const std::string shown_path = store_.name_of(key);
        if (node.has("plate")) {
            const auto wells = paths_in(node.attributes["plate"], "wells");
            if (series) return chosen(key, wells, *series, "wells");
            refuse(path_,
                   fmt::format("is a plate of {} wells{}{}: name the folder of one image{}",
                               wells.size(), wells.empty() ? "" : ", ", quoted_list(wells),
                               wells.empty() ? "" : fmt::format(", as {}/{}/0", path_, wells[0])));
        }
        if (node.has("well"))
            return only_one(key, paths_in(node.attributes["well"], "images"), "images of a well",
                            series);
        if (node.has("labels") && node.attributes["labels"].is_array()) {
            std::vector<std::string> names;
            for (const Json& label : node.attributes["labels"])
                if (label.is_string()) names.push_back(label.get<std::string>());
            return only_one(key, names, "label images", series);
        }
        const Content content = content_of(store_, key);
        const std::string all = text_of(content);
        if (all.empty()) refuse(path_, "is a Zarr group that holds no image and no array");
        for (const auto& [kind, names] :
             {std::pair("images", &content.images), std::pair("arrays", &content.arrays),
              std::pair("label images", &content.labels), std::pair("groups", &content.groups)}) {
            if (names->empty()) continue;
            if (series) return chosen(key, *names, *series, kind);
            if (names->size() == 1) return names->front();
            throw RequestError(message(
                "{}: is a Zarr group of {} {}: {}. Choose one with @series 0 ... {}, or name its "
                "folder, as {}/{}",
                path_, names->size(), kind, all, names->size() - 1, shown_path, names->front()));
        }
        refuse(path_, "is a Zarr group that holds no image and no array");
    }

    std::string only_one(const std::string& key, const std::vector<std::string>& names,
                         const char* kind, const std::optional<std::string>& series) const {
        if (series) return chosen(key, names, *series, kind);
        if (names.empty()) refuse(path_, fmt::format("is a Zarr group of no {}", kind));
        if (names.size() > 1)
            throw RequestError(
                message("{}: holds {} {}: {}. Choose one with @series 0 ... {}, or name its "
                        "folder, as {}/{}",
                        path_, names.size(), kind, quoted_list(names), names.size() - 1,
                        store_.name_of(key), names[0]));
        return inside(key, names[0]);
    }

    std::string chosen(const std::string& key, const std::vector<std::string>& names,
                       const std::string& series, const char* kind) const {
        const bool climbs = series.find("..") != std::string::npos || series.starts_with('/');
        if (!series.empty() && !climbs && is_zarr_node(store_, zarr_key(key, series)))
            return series;
        const auto number = to_integer(series);
        if (!number || *number < 0 || *number >= static_cast<std::int64_t>(names.size()))
            throw RequestError(message("{}: @series({}): it holds {} {}: {}", path_,
                                       in_quotes(series), names.size(), kind, quoted_list(names)));
        return inside(key, names[static_cast<std::size_t>(*number)]);
    }
    /// A name that the metadata give.
    std::string inside(const std::string& key, const std::string& name) const {
        const bool climbs = name.find("..") != std::string::npos || name.starts_with('/');
        if (name.empty() || climbs || !store_.has_folder(zarr_key(key, name)))
            refuse(path_, fmt::format("names {}, which is no folder in it", in_quotes(name)));
        return name;
    }

    const ZarrStore& store_;
    const std::string& path_;
};

}  // namespace

ZarrPlace zarr_place_of(const ZarrStore& store, const std::string& key, const std::string& path,
                        const Selection& pick) {
    return Search(store, path).place(key, pick.series);
}

}  // namespace edgewise::store
