#include "io/zip.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <zlib.h>

#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::uint32_t kLocal = 0x04034b50, kCentral = 0x02014b50, kEnd = 0x06054b50;
constexpr std::uint32_t kEnd64 = 0x06064b50, kLocator64 = 0x07064b50;
constexpr std::size_t kLocalBytes = 30, kCentralBytes = 46, kEndBytes = 22, kLocatorBytes = 20;
constexpr std::size_t kEnd64Bytes = 56, kMostComment = 65535;
constexpr std::uint32_t kElsewhere = 0xffffffff;  // a number that stands in the ZIP64 field
constexpr std::uint16_t kZip64 = 1, kStored = 0, kDeflated = 8, kEncrypted = 1;

template <class T>
T number_at(std::span<const std::byte> bytes, std::size_t at) {
    T number = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i)
        number |= static_cast<T>(std::to_integer<T>(bytes[at + i]) << 8 * i);
    return number;
}
std::uint16_t u16(std::span<const std::byte> bytes, std::size_t at) {
    return number_at<std::uint16_t>(bytes, at);
}
std::uint32_t u32(std::span<const std::byte> bytes, std::size_t at) {
    return number_at<std::uint32_t>(bytes, at);
}
std::uint64_t u64(std::span<const std::byte> bytes, std::size_t at) {
    return number_at<std::uint64_t>(bytes, at);
}

/// What ends the file says of the directory.
struct ZipDirectory {
    std::uint64_t offset = 0, size = 0, end = 0;  // end: where it ends in the file
};

ZipDirectory zip_directory_of(const File& file) {
    const std::string& path = file.path();
    const std::uint64_t size = file.size();
    const auto tail =
        static_cast<std::size_t>(std::min<std::uint64_t>(size, kEndBytes + kMostComment));
    Bytes bytes(tail);
    file.read(size - tail, bytes, "end of the ZIP file");
    for (std::size_t i = tail < kEndBytes ? 0 : tail - kEndBytes + 1; i-- > 0;) {
        if (u32(bytes, i) != kEnd || i + kEndBytes + u16(bytes, i + 20) > tail) continue;
        const std::uint64_t at = size - tail + i;
        ZipDirectory found{u32(bytes, i + 16), u32(bytes, i + 12), at};
        const bool wide =
            found.offset == kElsewhere || found.size == kElsewhere || u16(bytes, i + 10) == 0xffff;
        if (!wide || at < kLocatorBytes) return found;
        Bytes locator(kLocatorBytes), end(kEnd64Bytes);
        file.read(at - kLocatorBytes, locator, "ZIP64 locator");
        if (u32(locator, 0) != kLocator64) return found;
        const std::uint64_t from = u64(locator, 8);
        if (from > size || size - from < kEnd64Bytes) refuse(path, "ZIP64 end beyond the file");
        file.read(from, end, "ZIP64 end");
        if (u32(end, 0) != kEnd64) refuse(path, "its ZIP64 end is damaged");
        return {u64(end, 48), u64(end, 40), from};
    }
    refuse(path, "is a ZIP file without an end: cut off, or damaged");
}

/// Numbers of 64 bits, in the order in which the plain fields point to them.
void take_wide_fields(std::span<const std::byte> extra, ZipArchive::Entry& entry) {
    for (std::size_t at = 0; at + 4 <= extra.size();) {
        const std::size_t length = u16(extra, at + 2);
        if (length > extra.size() - at - 4) return;
        if (u16(extra, at) == kZip64) {
            const std::span<const std::byte> field = extra.subspan(at + 4, length);
            std::size_t next = 0;
            for (std::uint64_t* number : {&entry.size, &entry.packed, &entry.header})
                if (*number == kElsewhere && next + 8 <= field.size())
                    *number = u64(field, next), next += 8;
            return;
        }
        at += 4 + length;
    }
}

}  // namespace

ZipArchive::ZipArchive(const std::string& path) : file_(std::make_shared<const File>(path)) {
    read_directory();
}

void ZipArchive::read_directory() {
    const ZipDirectory where = zip_directory_of(*file_);
    // What stands before the first file moves all of them.
    if (where.size > where.end || where.offset > where.end - where.size)
        refuse(path(), "its ZIP directory lies beyond the file");
    const std::uint64_t moved = where.end - where.size - where.offset;
    Bytes bytes(static_cast<std::size_t>(where.size));
    file_->read(where.end - where.size, bytes, "ZIP directory");
    const std::span<const std::byte> all(bytes);
    for (std::size_t at = 0; at < all.size();) {
        if (all.size() - at < kCentralBytes || u32(all, at) != kCentral)
            refuse(path(), "its ZIP directory is damaged");
        const std::size_t name = u16(all, at + 28), extra = u16(all, at + 30);
        const std::size_t comment = u16(all, at + 32);
        if (all.size() - at - kCentralBytes < name + extra + comment)
            refuse(path(), "its ZIP directory is damaged");
        Entry entry;
        entry.flags = u16(all, at + 8);
        entry.method = u16(all, at + 10);
        entry.crc = u32(all, at + 16);
        entry.packed = u32(all, at + 20);
        entry.size = u32(all, at + 24);
        entry.header = u32(all, at + 42);
        take_wide_fields(all.subspan(at + kCentralBytes + name, extra), entry);
        entry.header += moved;
        std::string key(reinterpret_cast<const char*>(bytes.data()) + at + kCentralBytes, name);
        std::replace(key.begin(), key.end(), '\\', '/');
        entries_[std::move(key)] = entry;
        at += kCentralBytes + name + extra + comment;
    }
}

std::uint64_t ZipArchive::begin(const std::string& name, const Entry& entry) const {
    const std::string place = fmt::format("{}: {}", path(), in_quotes(name));
    if (entry.flags & kEncrypted) refuse(place, "is encrypted");
    if (entry.method != kStored && entry.method != kDeflated)
        refuse(place, fmt::format("ZIP method {} is not supported; expected 0 (stored) or 8 "
                                  "(deflated)",
                                  entry.method));
    if (entry.header > file_->size() || file_->size() - entry.header < kLocalBytes)
        refuse(place, "lies beyond the ZIP file");
    Bytes local(kLocalBytes);
    file_->read(entry.header, local, "ZIP header");
    if (u32(local, 0) != kLocal) refuse(place, "its ZIP header is damaged");
    const std::uint64_t from = entry.header + kLocalBytes + u16(local, 26) + u16(local, 28);
    if (from > file_->size() || entry.packed > file_->size() - from)
        refuse(place, "lies beyond the ZIP file");
    if (entry.method == kStored && entry.packed != entry.size)
        refuse(place, fmt::format("is stored, and has {} and {} bytes", entry.packed, entry.size));
    return from;
}

Bytes ZipArchive::inflated(const std::string& name, const Entry& entry) const {
    const std::uint64_t from = begin(name, entry);
    const std::string place = fmt::format("{}: {}", path(), in_quotes(name));
    if (entry.size / kDeflateRatio > entry.packed)
        refuse(place, fmt::format("{} bytes do not come from {}", entry.size, entry.packed));
    Bytes bytes(static_cast<std::size_t>(entry.size));
    const auto stream = open_stream(file_, from, from + entry.packed, Wrapping::deflate);
    read_all(*stream, bytes, place);
    uLong crc = crc32_z(0, nullptr, 0);
    crc = crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
    if (crc != entry.crc) refuse(place, "its checksum is wrong");
    return bytes;
}

bool is_zip(const std::string& path) {
    const Bytes head = File(path).head(4);
    return head.size() == 4 && (u32(head, 0) == kLocal || u32(head, 0) == kEnd);
}

}  // namespace edgewise::store
