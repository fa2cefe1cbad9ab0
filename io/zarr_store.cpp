#include "io/zarr_store.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <set>

#include "graph/errors.hpp"
#include "io/text.hpp"
#include "io/zarr_array.hpp"
#include "io/zip.hpp"

namespace edgewise::store {
namespace {

namespace fs = std::filesystem;

class PlainFile : public ZarrFile {
 public:
    explicit PlainFile(const std::string& path) : file_(path) {}
    std::uint64_t size() const override { return file_.size(); }
    void read(std::uint64_t offset, std::span<std::byte> into) const override {
        file_.read(offset, into, "data");
    }

 private:
    File file_;
};

class FolderStore : public ZarrStore {
 public:
    explicit FolderStore(std::string folder) : folder_(std::move(folder)) {}

    std::string name_of(const std::string& key) const override {
        return key.empty() ? folder_ : zarr_key(folder_, key);
    }
    bool has_file(const std::string& key) const override {
        std::error_code none;
        return fs::is_regular_file(name_of(key), none);
    }
    bool has_folder(const std::string& key) const override {
        std::error_code none;
        return fs::is_directory(name_of(key), none);
    }
    std::vector<std::string> folders(const std::string& key) const override {
        std::vector<std::string> names;
        std::error_code none;
        for (const auto& entry : fs::directory_iterator(name_of(key), none))
            if (entry.is_directory(none)) names.push_back(entry.path().filename().string());
        std::sort(names.begin(), names.end(), numeric_less);
        return names;
    }
    std::unique_ptr<ZarrFile> open(const std::string& key, std::uint64_t /*most*/) const override {
        std::error_code none;
        if (!fs::exists(name_of(key), none)) return nullptr;
        return std::make_unique<PlainFile>(name_of(key));
    }

 private:
    std::string folder_;
};

/// A file that lies in the ZIP file as it is.
class PartFile : public ZarrFile {
 public:
    PartFile(std::shared_ptr<const File> file, std::uint64_t begin, std::uint64_t size)
        : file_(std::move(file)), begin_(begin), size_(size) {}
    std::uint64_t size() const override { return size_; }
    void read(std::uint64_t offset, std::span<std::byte> into) const override {
        if (offset > size_ || into.size() > size_ - offset)
            refuse(file_->path(), "short data in the ZIP file");
        file_->read(begin_ + offset, into, "data");
    }

 private:
    std::shared_ptr<const File> file_;
    std::uint64_t begin_, size_;
};

class UnpackedFile : public ZarrFile {
 public:
    UnpackedFile(std::string name, Bytes bytes)
        : name_(std::move(name)), bytes_(std::move(bytes)) {}
    std::uint64_t size() const override { return bytes_.size(); }
    void read(std::uint64_t offset, std::span<std::byte> into) const override {
        if (offset > bytes_.size() || into.size() > bytes_.size() - offset)
            refuse(name_, "short data");
        std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), into.size(),
                    into.begin());
    }

 private:
    std::string name_;
    Bytes bytes_;
};

/// The name of a file that describes a group or array.
bool describes_zarr(std::string_view name) {
    return name == kZarrVersion3 || name == ".zarray" || name == ".zgroup" || name == ".zattrs";
}

class ZipStore : public ZarrStore {
 public:
    explicit ZipStore(const std::string& path) : archive_(path) {
        find_top();
        for (const auto& [name, entry] : archive_.entries()) {
            if (!name.starts_with(top_)) continue;
            for (std::size_t at = name.find('/', top_.size()); at != std::string::npos;
                 at = name.find('/', at + 1))
                folders_.insert(name.substr(top_.size(), at - top_.size()));
            deflated_ = deflated_ || entry.method != 0;
        }
    }

    std::string name_of(const std::string& key) const override {
        return key.empty() ? archive_.path() : archive_.path() + "/" + key;
    }
    bool has_file(const std::string& key) const override {
        return archive_.entries().contains(top_ + key);
    }
    bool has_folder(const std::string& key) const override {
        return key.empty() || folders_.contains(key);
    }
    std::vector<std::string> folders(const std::string& key) const override {
        const std::string prefix = key.empty() ? "" : key + "/";
        std::vector<std::string> names;
        for (auto at = folders_.lower_bound(prefix); at != folders_.end(); ++at) {
            if (!at->starts_with(prefix)) break;
            const std::string name = at->substr(prefix.size());
            if (!name.empty() && name.find('/') == std::string::npos) names.push_back(name);
        }
        std::sort(names.begin(), names.end(), numeric_less);
        return names;
    }
    std::unique_ptr<ZarrFile> open(const std::string& key, std::uint64_t most) const override {
        const auto found = archive_.entries().find(top_ + key);
        if (found == archive_.entries().end()) return nullptr;
        const ZipArchive::Entry& entry = found->second;
        if (entry.method == 0)
            return std::make_unique<PartFile>(archive_.file(), archive_.begin(key, entry),
                                              entry.size);
        if (entry.size > most)
            refuse(name_of(key),
                   fmt::format("holds {} bytes, expected at most {}", entry.size, most));
        return std::make_unique<UnpackedFile>(name_of(key), archive_.inflated(key, entry));
    }
    bool unpacks() const override { return deflated_; }
    std::optional<std::vector<std::string>> files() const override {
        return std::vector<std::string>{archive_.path()};
    }

 private:
    /// The folder nearest to the top that describes itself as Zarr; it must be the only one there.
    void find_top() {
        std::size_t depth = std::string::npos;
        std::set<std::string> tops;
        for (const auto& [name, entry] : archive_.entries()) {
            const std::size_t slash = name.rfind('/');
            const std::size_t from = slash == std::string::npos ? 0 : slash + 1;
            if (!describes_zarr(std::string_view(name).substr(from))) continue;
            const auto deep = static_cast<std::size_t>(std::count(name.begin(), name.end(), '/'));
            if (deep < depth) tops.clear();
            depth = std::min(depth, deep);
            if (deep == depth) tops.insert(name.substr(0, from));
        }
        if (tops.empty())
            refuse(archive_.path(),
                   "is a ZIP file that holds no Zarr (zarr.json, .zgroup, .zarray or .zattrs); "
                   "unpack it and name what is inside");
        if (tops.size() > 1) {
            std::string names;
            for (const std::string& name : tops)
                names += (names.empty() ? "" : ", ") + in_quotes(name.substr(0, name.size() - 1));
            refuse(archive_.path(),
                   "is a ZIP file of several Zarr folders, " + names + ": unpack it and name one");
        }
        top_ = *tops.begin();
    }

    ZipArchive archive_;
    std::string top_;  // in front of all keys, with its slash
    std::set<std::string> folders_;
    bool deflated_ = false;
};

}  // namespace

std::optional<std::pair<std::string, std::string>> into_zip(const std::string& path) {
    std::error_code none;
    std::string file = path, key;
    while (file.size() > 1 && file.ends_with('/')) file.pop_back();
    while (!file.empty() && !fs::exists(file, none)) {
        const std::size_t slash = file.rfind('/');
        if (slash == std::string::npos || slash == 0) return std::nullopt;
        key = zarr_key(file.substr(slash + 1), key);
        if (key.ends_with('/')) key.pop_back();
        file.resize(slash);
    }
    if (!fs::is_regular_file(file, none) || !is_zip(file)) return std::nullopt;
    return std::pair(file, key);
}

std::pair<std::shared_ptr<const ZarrStore>, std::string> open_zarr(const std::string& path) {
    std::string folder = path;
    while (folder.size() > 1 && folder.ends_with('/')) folder.pop_back();
    if (fs::is_directory(folder)) return {std::make_shared<FolderStore>(folder), ""};
    const auto zip = into_zip(path);
    if (!zip) refuse(path, "is no folder and no ZIP file");
    auto store = std::make_shared<ZipStore>(zip->first);
    if (!zip->second.empty() && !store->has_folder(zip->second))
        refuse(path, fmt::format("{} holds no {}", zip->first, in_quotes(zip->second)));
    return {std::move(store), zip->second};
}

}  // namespace edgewise::store
