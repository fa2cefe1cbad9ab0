#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/store.hpp"

namespace edgewise::store {

/// One file of a Zarr hierarchy, open.
class ZarrFile {
 public:
    virtual ~ZarrFile() = default;
    virtual std::uint64_t size() const = 0;
    /// May be called from several threads. @throws InputError where the file is shorter
    virtual void read(std::uint64_t offset, std::span<std::byte> into) const = 0;
};

/// Where the files of a Zarr hierarchy are: a folder, or one ZIP file. Keys are paths from the top
/// with slashes, "" is the top.
class ZarrStore {
 public:
    virtual ~ZarrStore() = default;
    /// What a key is called in messages.
    virtual std::string name_of(const std::string& key) const = 0;
    virtual bool has_file(const std::string& key) const = 0;
    virtual bool has_folder(const std::string& key) const = 0;
    /// Names of the folders in a folder, sorted, "a2" before "a10".
    virtual std::vector<std::string> folders(const std::string& key) const = 0;
    /// Nothing where it is not there.
    /// @param most  of a file that is packed as a whole: bytes that may be unpacked
    virtual std::unique_ptr<ZarrFile> open(const std::string& key, std::uint64_t most) const = 0;
    /// Whether files are unpacked as a whole before any of their bytes can be read.
    virtual bool unpacks() const { return false; }
    /// All that is read, where the file itself tells of changes.
    virtual std::optional<std::vector<std::string>> files() const { return std::nullopt; }
};

inline std::string zarr_key(const std::string& folder, const std::string& name) {
    return folder.empty() ? name : folder + "/" + name;
}

/// Opens a folder, a ZIP file, or what lies at a path within a ZIP file. The top of a ZIP file may
/// be the one folder in it that holds Zarr.
/// @return the store, and the key that the path names
std::pair<std::shared_ptr<const ZarrStore>, std::string> open_zarr(const std::string& path);

/// The ZIP file that such a path leads into, and the key; nothing where it leads into none.
std::optional<std::pair<std::string, std::string>> into_zip(const std::string& path);

}  // namespace edgewise::store
