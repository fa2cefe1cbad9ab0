#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/number_streams.hpp"
#include "io/zarr_codecs.hpp"

namespace edgewise::store {

/// Where version 3 of Zarr describes a group or array.
inline constexpr const char* kZarrVersion3 = "zarr.json";

/// What describes a group or array, whatever the version.
struct ZarrNode {
    nlohmann::json array;       // null: a group
    nlohmann::json attributes;  // object, or null
    bool version3 = false;

    bool has(const char* name) const { return attributes.is_object() && attributes.contains(name); }
};

/// @throws InputError  a description that is no JSON object
ZarrNode zarr_node_of(const std::string& folder);

/// One array, and how its chunks lie in files.
struct ZarrArray {
    std::string folder;
    std::vector<std::int64_t> shape, chunks;  // slowest first, in the order of the array's axes
    Type type = Type::u8;
    Wide wide = Wide::no;
    bool big_endian = false, first_is_fastest = false;
    std::vector<ZarrCodec> codecs;  // in the order in which bytes are decoded
    std::string prefix, separator;  // of a chunk's name
    Bytes fill;                     // one number, as it is stored

    std::size_t width() const noexcept { return wide == Wide::no ? bytes_of(type) : 8; }
    std::size_t chunk_bytes() const noexcept {
        std::size_t bytes = width();
        for (const std::int64_t side : chunks) bytes *= static_cast<std::size_t>(side);
        return bytes;
    }
};

/// What the node of an array says.
/// @throws InputError  the field that is wrong or not supported
ZarrArray zarr_array_of(const std::string& folder, const ZarrNode& node);

}  // namespace edgewise::store
