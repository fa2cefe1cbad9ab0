#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "io/store.hpp"

namespace edgewise::store {

/// A regular file, open for reading at any offset.
class File {
 public:
    /// @throws InputError missing, not readable, or not a regular file
    explicit File(const std::string& path);
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    ~File();

    const std::string& path() const noexcept { return path_; }
    std::uint64_t size() const noexcept { return size_; }
    /// As many bytes as there are. @throws InputError where the disk fails
    std::size_t read_some(std::uint64_t offset, std::span<std::byte> into) const;
    /// @throws InputError where the file is shorter, naming `what`
    void read(std::uint64_t offset, std::span<std::byte> into, const char* what) const;
    Bytes head(std::size_t most) const;

 private:
    std::string path_;
    int descriptor_ = -1;
    std::uint64_t size_ = 0;
};
using FilePointer = std::shared_ptr<const File>;

/// Bytes one after another.
class Stream {
 public:
    virtual ~Stream() = default;
    /// Fills `into` unless the end comes first. @return bytes read
    virtual std::size_t read(std::span<std::byte> into) = 0;
    /// @return whether so many bytes were there
    virtual bool skip(std::uint64_t bytes);
};
/// Bytes that are in memory already.
class MemoryStream : public Stream {
 public:
    explicit MemoryStream(std::span<const std::byte> bytes) : left_(bytes) {}
    std::size_t read(std::span<std::byte> into) override;

 private:
    std::span<const std::byte> left_;
};
/// All of `into`. @throws InputError short data, with the count
void read_all(Stream&, std::span<std::byte> into, const std::string& file);

enum class Wrapping { none, gzip, zlib, deflate, bzip2 };
/// @throws InputError where the data end before so many bytes
void skip_all(Stream&, std::uint64_t bytes, const std::string& file);

/// @param begin,end bytes of the file that belong to the stream
std::unique_ptr<Stream> open_stream(FilePointer, std::uint64_t begin, std::uint64_t end, Wrapping);

/// After the last byte that is needed: checks the checksum of a compressed stream if its end is
/// near. @return a warning where data follow, or ""
/// @throws InputError wrong checksum, stream that ends early
std::string check_end(Stream&, const std::string& file);

bool starts_gzip(std::span<const std::byte> bytes) noexcept;

/// No deflate stream expands further: 258 bytes take at least 2 bits, and a block its header.
inline constexpr std::int64_t kDeflateRatio = 1032;

/// The path of a file that a header names, inside the header's own folder.
/// @throws InputError absolute, climbing out (also by a link), or missing
std::string beside(const std::string& header, std::string_view name);
std::string folder_of(const std::string& path);

/// Opens a missing file under a name of its own beside `path`; commit() renames it there. "-" is
/// standard output.
class Replacement {
 public:
    explicit Replacement(std::string path);
    Replacement(const Replacement&) = delete;
    Replacement& operator=(const Replacement&) = delete;
    ~Replacement();

    void write(std::span<const std::byte> bytes);  // at the end
    void seek(std::uint64_t to);
    std::uint64_t tell() const;
    std::size_t read_back(std::span<std::byte> into);  // from the place of seek
    void commit();
    const std::string& temporary() const noexcept { return temporary_; }
    const std::string& path() const noexcept { return path_; }

 private:
    [[noreturn]] void fail(const char* what) const;
    std::string path_, temporary_;
    int descriptor_ = -1;
    bool direct_ = false;  // a device or a pipe: written to, never replaced
};

}  // namespace edgewise::store
