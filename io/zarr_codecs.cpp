#include "io/zarr_codecs.hpp"

#include <algorithm>
#include <blosc.h>
#include <cstring>
#include <fmt/format.h>
#include <memory>
#include <span>
#include <utility>
#include <zstd.h>

#include "io/file.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

/// Blosc and zstd pack zeros a million times denser than this; noise and pictures never.
constexpr std::int64_t kDensest = 1 << 16;
constexpr std::size_t kChecksum = 4;  // bytes of CRC-32C behind the data

std::string damaged(const char* codec) { return fmt::format("the {} data are damaged", codec); }

Bytes by_blosc(const std::string& path, const Bytes& packed, std::size_t bytes) {
    std::size_t size = 0;
    if (packed.size() < BLOSC_MIN_HEADER_LENGTH ||
        blosc_cbuffer_validate(packed.data(), packed.size(), &size) < 0)
        refuse(path, damaged("blosc"));
    if (size != bytes) refuse(path, fmt::format("holds {} bytes, expected {}", size, bytes));
    Bytes out(bytes);
    const int got = blosc_decompress_ctx(packed.data(), out.data(), out.size(), 1);
    if (got < 0 || static_cast<std::size_t>(got) != bytes) refuse(path, damaged("blosc"));
    return out;
}

Bytes by_zstd(const std::string& path, const Bytes& packed, std::size_t bytes) {
    Bytes out(bytes);
    const std::size_t got = ZSTD_decompress(out.data(), out.size(), packed.data(), packed.size());
    if (ZSTD_isError(got))
        refuse(path, fmt::format("{}: {}", damaged("zstd"), ZSTD_getErrorName(got)));
    if (got != bytes) refuse(path, fmt::format("holds {} bytes, expected {}", got, bytes));
    return out;
}

Bytes by_stream(const std::shared_ptr<const File>& file, Wrapping wrapping, std::size_t bytes) {
    Bytes out(bytes);
    const auto stream = open_stream(file, 0, file->size(), wrapping);
    read_all(*stream, out, file->path());
    std::byte more[1];
    if (stream->read(more) > 0 || !check_end(*stream, file->path()).empty())
        refuse(file->path(), fmt::format("holds more than the expected {} bytes", bytes));
    return out;
}

/// CRC-32 of Castagnoli.
std::uint32_t crc32c(std::span<const std::byte> bytes) noexcept {
    std::uint32_t crc = ~std::uint32_t{0};
    for (const std::byte byte : bytes) {
        crc ^= std::to_integer<std::uint32_t>(byte);
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0x82f63b78u : 0u);
    }
    return ~crc;
}

/// Checks the sum behind the data and takes it off.
void take_checksum(const std::string& path, Bytes& bytes) {
    if (bytes.size() < kChecksum) refuse(path, damaged("crc32c"));
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < kChecksum; ++i)
        sum |= std::to_integer<std::uint32_t>(bytes[bytes.size() - kChecksum + i]) << 8 * i;
    bytes.resize(bytes.size() - kChecksum);
    if (crc32c(bytes) != sum) refuse(path, "its checksum is wrong");
}

}  // namespace

std::optional<ZarrCodec> zarr_codec(std::string_view name) noexcept {
    constexpr std::pair<std::string_view, ZarrCodec> kNames[] = {
        {"blosc", ZarrCodec::blosc}, {"zstd", ZarrCodec::zstd}, {"zlib", ZarrCodec::zlib},
        {"gzip", ZarrCodec::gzip},   {"bz2", ZarrCodec::bz2},   {"crc32c", ZarrCodec::crc32c}};
    for (const auto& [known, codec] : kNames)
        if (name == known) return codec;
    return std::nullopt;
}

Bytes decoded(const std::string& path, const std::vector<ZarrCodec>& codecs, std::size_t bytes) {
    const auto file = std::make_shared<const File>(path);
    std::vector<ZarrCodec> left = codecs;
    Bytes packed;
    const auto load = [&] {
        packed.resize(file->size());
        file->read(0, packed, "chunk");
    };
    if (!left.empty() && left.front() == ZarrCodec::crc32c) {
        load();
        take_checksum(path, packed);
        left.erase(left.begin());
    }
    const bool checked = !packed.empty();
    if (left.empty()) {
        if (!checked) {
            if (file->size() != bytes)
                refuse(path, fmt::format("holds {} bytes, expected {}", file->size(), bytes));
            load();
        }
        if (packed.size() != bytes)
            refuse(path, fmt::format("holds {} bytes, expected {}", packed.size(), bytes));
        return packed;
    }
    if (left.size() > 1) refuse(path, "several codecs after one another are not supported");
    check_density(path, static_cast<std::int64_t>(bytes), file->size(), kDensest);
    switch (left.front()) {
        case ZarrCodec::blosc:
            if (!checked) load();
            return by_blosc(path, packed, bytes);
        case ZarrCodec::zstd:
            if (!checked) load();
            return by_zstd(path, packed, bytes);
        case ZarrCodec::zlib:
            return by_stream(file, Wrapping::zlib, bytes);
        case ZarrCodec::gzip:
            return by_stream(file, Wrapping::gzip, bytes);
        case ZarrCodec::bz2:
            return by_stream(file, Wrapping::bzip2, bytes);
        case ZarrCodec::crc32c:
            break;
    }
    refuse(path, "a checksum within the data is not supported");
}

}  // namespace edgewise::store
