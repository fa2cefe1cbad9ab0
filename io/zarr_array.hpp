#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/number_streams.hpp"
#include "io/zarr_codecs.hpp"
#include "io/zarr_store.hpp"

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

/// Whether a folder describes itself as a group or array.
bool is_zarr_node(const ZarrStore&, const std::string& key);
/// @throws InputError  a description that is no JSON object
ZarrNode zarr_node_of(const ZarrStore&, const std::string& key);

/// How the chunks of a shard lie in its file (Zarr 3, codec `sharding_indexed` 1.0).
struct ZarrShards {
    std::vector<std::int64_t> sides;  // of a shard, slowest axis of the array first
    std::vector<std::size_t> order;   // axes of the array in the order of the index, slowest first
    bool index_first = false, index_big_endian = false, index_summed = false;
};

/// One array, and how its chunks lie in files. A chunk that lies in a shard is a chunk as any
/// other.
struct ZarrArray {
    std::shared_ptr<const ZarrStore> store;
    std::string key;
    std::vector<std::int64_t> shape, chunks;  // slowest first, in the order of the array's axes
    Type type = Type::u8;
    Wide wide = Wide::no;
    std::vector<std::size_t> order;   // axes of the array as a chunk stores them, slowest first
    ZarrNumber stored;                // a number of an unpacked chunk
    std::vector<ZarrCodec> codecs;    // in the order in which bytes are decoded
    std::vector<ZarrFilter> filters;  // the same of numbers, after the bytes
    std::optional<ZarrShards> shards;
    std::string prefix, separator;  // of a file's name
    Bytes fill;                     // one native number

    std::size_t width() const noexcept { return wide == Wide::no ? bytes_of(type) : 8; }
    std::size_t chunk_numbers() const noexcept {
        std::size_t numbers = 1;
        for (const std::int64_t side : chunks) numbers *= static_cast<std::size_t>(side);
        return numbers;
    }
    std::size_t chunk_bytes() const noexcept { return width() * chunk_numbers(); }
    /// Sides of the box of samples in one file.
    const std::vector<std::int64_t>& file_sides() const noexcept {
        return shards ? shards->sides : chunks;
    }
    /// Chunks of one file.
    std::size_t chunks_in_file() const noexcept {
        std::size_t count = 1;
        for (std::size_t i = 0; i < chunks.size(); ++i)
            count *= static_cast<std::size_t>(file_sides()[i] / chunks[i]);
        return count;
    }
};

/// What the node of an array says.
/// @throws InputError  the field that is wrong or not supported
ZarrArray zarr_array_of(std::shared_ptr<const ZarrStore>, const std::string& key,
                        const ZarrNode& node);

}  // namespace edgewise::store
