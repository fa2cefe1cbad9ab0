#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/store.hpp"

namespace edgewise::store {

/// How one number is stored.
struct ZarrNumber {
    char kind = 'u';  // b: bool, u and i: integers, f: floats
    std::size_t bytes = 1;
    bool big_endian = false;

    bool is_float() const noexcept { return kind == 'f'; }
};
/// "<u2", "|b1", "f4" and "uint16", "float32".
std::optional<ZarrNumber> zarr_number(const std::string& name);

/// Codecs from bytes to bytes: how a chunk is packed.
struct ZarrCodec {
    enum class Kind {
        blosc,
        zstd,
        zlib,
        gzip,
        bz2,
        lzma,
        lz4,
        shuffle,
        crc32,
        crc32c,
        adler32
    } kind;
    std::size_t element = 4;  // bytes of one number that was shuffled
    bool sum_first = false;   // a checksum stands before the data
};

/// Codecs from numbers to numbers.
struct ZarrFilter {
    enum class Kind { delta, scale, pack_bits, transpose } kind;
    ZarrNumber plain, stored;  // before and after it was applied
    double scale = 1, offset = 0;
    std::vector<std::size_t> order;   // transpose: axis i of the stored is order[i] of the plain
    std::vector<std::int64_t> shape;  // transpose: of the plain chunk
};

/// A codec by its name in the array's description (that of numcodecs too) and its settings.
/// Nothing where it is not known; `problem` then says what about a known one is not supported.
std::optional<ZarrCodec> zarr_codec(const std::string& name, const nlohmann::json& settings,
                                    std::string& problem);
/// The same of a filter, but for transpose. @param plain  what it is applied to
std::optional<ZarrFilter> zarr_filter(const std::string& name, const nlohmann::json& settings,
                                      const ZarrNumber& plain, std::string& problem);

/// Bytes that a packed chunk of so many bytes may have at most, in any codec that is worth its
/// name: noise grows a little.
constexpr std::uint64_t most_packed(std::uint64_t bytes) { return 2 * bytes + (1 << 16); }

/// Unpacks a chunk.
/// @param name    for messages
/// @param codecs  in the order in which they are taken off
/// @param bytes   that it has then
/// @throws InputError damaged, or of another size
Bytes decoded(const std::string& name, Bytes packed, const std::vector<ZarrCodec>& codecs,
              std::size_t bytes);

/// Bytes of `count` numbers before a filter is taken off.
std::size_t filtered_bytes(const ZarrFilter& filter, std::size_t count) noexcept;
/// Takes filters off, one after another. @param bytes native numbers
Bytes unfiltered(const std::string& name, Bytes bytes, const std::vector<ZarrFilter>& filters,
                 std::size_t count);

}  // namespace edgewise::store
