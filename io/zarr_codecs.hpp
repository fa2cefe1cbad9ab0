#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/store.hpp"

namespace edgewise::store {

/// What a chunk of a Zarr array is packed with.
enum class ZarrCodec { blosc, zstd, zlib, gzip, bz2, crc32c };
/// By its name in the array's description; nothing where it is not known.
std::optional<ZarrCodec> zarr_codec(std::string_view name) noexcept;

/// A chunk's file, unpacked.
/// @param codecs  in the order in which they are taken off
/// @param bytes   that it has then
/// @throws InputError damaged, or of another size
Bytes decoded(const std::string& path, const std::vector<ZarrCodec>& codecs, std::size_t bytes);

}  // namespace edgewise::store
