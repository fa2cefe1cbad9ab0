#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>

#include "io/file.hpp"

namespace edgewise::store {

/// The files in a ZIP file (APPNOTE 6.3.9, ZIP64 too), by what its central directory says. Only
/// that is read when it is opened. Names never climb out: they are keys, not paths.
class ZipArchive {
 public:
    struct Entry {
        std::uint64_t header = 0;  // where its own header begins
        std::uint64_t packed = 0, size = 0;
        std::uint32_t crc = 0;
        std::uint16_t method = 0, flags = 0;
    };

    /// @throws InputError no ZIP file, or a directory that is damaged
    explicit ZipArchive(const std::string& path);

    /// In the order of names; of several with one name the last.
    const std::map<std::string, Entry>& entries() const noexcept { return entries_; }
    const std::string& path() const noexcept { return file_->path(); }
    const std::shared_ptr<const File>& file() const noexcept { return file_; }

    /// Where the bytes of an entry begin.
    /// @throws InputError encrypted, packed by something else than deflate, or beyond the file
    std::uint64_t begin(const std::string& name, const Entry&) const;
    /// All bytes of an entry that is deflated, its checksum checked.
    Bytes inflated(const std::string& name, const Entry&) const;

 private:
    void read_directory();

    std::shared_ptr<const File> file_;
    std::map<std::string, Entry> entries_;
};

/// Whether a file begins or ends as a ZIP file does.
bool is_zip(const std::string& path);

}  // namespace edgewise::store
