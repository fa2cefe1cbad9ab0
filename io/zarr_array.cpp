#include "io/zarr_array.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <limits>
#include <numeric>
#include <utility>

#include "graph/errors.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostText = 16 << 20;

/// A file of JSON in the folder; null where it is not there.
Json json_in(const ZarrStore& store, const std::string& folder, const char* name) {
    const std::string key = zarr_key(folder, name);
    if (!store.has_file(key)) return {};
    const auto file = store.open(key, kMostText);
    if (file->size() > kMostText)
        refuse(store.name_of(key), fmt::format("{} bytes of text are not supported", file->size()));
    Bytes bytes(static_cast<std::size_t>(file->size()));
    file->read(0, bytes);
    const char* text = reinterpret_cast<const char*>(bytes.data());
    Json json = Json::parse(text, text + bytes.size(), nullptr, false);
    if (!json.is_object()) refuse(store.name_of(key), "is not a JSON object");
    return json;
}

std::vector<std::size_t> in_turn(std::size_t axes) {
    std::vector<std::size_t> order(axes);
    std::iota(order.begin(), order.end(), std::size_t{0});
    return order;
}

/// Reads the fields of an array's description.
class ArrayParser {
 public:
    ArrayParser(std::shared_ptr<const ZarrStore> store, const std::string& key,
                const ZarrNode& node)
        : file_(store->name_of(zarr_key(key, node.version3 ? kZarrVersion3 : ".zarray"))),
          json_(node.array) {
        array_.store = std::move(store);
        array_.key = key;
        array_.shape = sizes("shape", json_.value("shape", Json()), 0);
        if (node.version3)
            take_version3();
        else
            take_version2();
        take_fill();
    }
    ZarrArray take() { return std::move(array_); }

 private:
    [[noreturn]] void fail(const std::string& field, const std::string& what) const {
        refuse(file_, fmt::format("field '{}': {}", field, what));
    }
    std::string text(const char* field, const Json& json) const {
        if (!json.is_string()) fail(field, "expected a text");
        return json.get<std::string>();
    }
    std::vector<std::int64_t> sizes(const char* field, const Json& json, std::int64_t least) const {
        constexpr std::size_t kMostAxes = 5;
        if (!json.is_array() || json.empty() || json.size() > kMostAxes)
            fail(field, "expected 1 to 5 whole numbers");
        std::vector<std::int64_t> all;
        for (const Json& size : json) {
            if (!size.is_number_integer() ||
                size.get<std::int64_t>() < std::max<std::int64_t>(least, 0))
                fail(field, fmt::format("expected whole numbers from {}", least));
            all.push_back(size.get<std::int64_t>());
        }
        return all;
    }

    void check_chunks() const {
        if (array_.chunks.size() != array_.shape.size())
            fail("chunks", "has another number of axes than the shape");
        std::int64_t bytes = static_cast<std::int64_t>(array_.width());
        for (const std::int64_t side : array_.chunks) bytes = product(file_, bytes, side);
        constexpr std::int64_t kMostBytes = std::numeric_limits<std::int32_t>::max();
        if (bytes > kMostBytes) fail("chunks", fmt::format("{} bytes are not supported", bytes));
    }

    void take_version2() {
        if (json_.value("zarr_format", 0) != 2) fail("zarr_format", "expected 2");
        array_.chunks = sizes("chunks", json_.value("chunks", Json()), 1);
        take_type("dtype", text("dtype", json_.value("dtype", Json())));
        check_chunks();
        array_.order = in_turn(array_.shape.size());
        const std::string order = text("order", json_.value("order", Json("C")));
        if (order != "C" && order != "F") fail("order", "expected C or F");
        if (order == "F") std::reverse(array_.order.begin(), array_.order.end());
        array_.separator =
            text("dimension_separator", json_.value("dimension_separator", Json(".")));
        if (array_.separator != "." && array_.separator != "/")
            fail("dimension_separator", "expected . or /");
        bool packed = false;
        if (const Json filters = json_.value("filters", Json()); !filters.is_null())
            for (const Json& filter : filters) {
                const std::string name = text("filters", filter.value("id", Json()));
                if (take_filter("filters", name, filter, packed)) continue;
                take_codec("filters", name, filter);
                packed = true;
            }
        if (const Json how = json_.value("compressor", Json()); !how.is_null())
            take_codec("compressor", text("compressor", how.value("id", Json())), how);
        end_codecs();
    }

    void take_version3() {
        if (json_.value("zarr_format", 0) != 3) fail("zarr_format", "expected 3");
        const Json grid = json_.value("chunk_grid", Json::object());
        if (grid.value("name", "") != "regular")
            fail("chunk_grid", "only regular ones are supported");
        array_.chunks =
            sizes("chunk_shape",
                  grid.value("configuration", Json::object()).value("chunk_shape", Json()), 1);
        if (const Json more = json_.value("storage_transformers", Json());
            !more.is_null() && !more.empty())
            fail("storage_transformers", "are not supported");
        take_type("data_type", text("data_type", json_.value("data_type", Json())));
        if (array_.chunks.size() != array_.shape.size()) check_chunks();
        const Json key = json_.value("chunk_key_encoding", Json::object());
        const std::string kind = key.value("name", "default");
        if (kind != "default" && kind != "v2") fail("chunk_key_encoding", "expected default or v2");
        if (kind == "default") array_.prefix = "c";
        array_.separator = key.value("configuration", Json::object())
                               .value("separator", kind == "default" ? "/" : ".");
        if (array_.separator != "." && array_.separator != "/")
            fail("separator", "expected . or /");
        if (!array_.prefix.empty()) array_.prefix += array_.separator;
        array_.order = in_turn(array_.shape.size());
        take_codecs(json_.value("codecs", Json()));
        check_chunks();
        end_codecs();
    }

    /// A codec's name and its settings; some writers give a name alone.
    std::pair<std::string, Json> codec_of(const Json& codec) const {
        if (codec.is_string()) return {codec.get<std::string>(), Json::object()};
        if (!codec.is_object()) fail("codecs", "expected a list of codecs");
        Json settings = codec.value("configuration", Json::object());
        if (!settings.is_object()) fail("codecs", "a configuration is no object");
        return {text("codecs", codec.value("name", Json())), std::move(settings)};
    }

    /// Numbers to numbers, then numbers to bytes, then bytes to bytes.
    void take_codecs(const Json& codecs) {
        if (!codecs.is_array()) fail("codecs", "expected a list of codecs");
        bool bytes = false;
        for (const Json& each : codecs) {
            const auto [name, settings] = codec_of(each);
            if (array_.shards && !in_shard_)
                fail("codecs",
                     fmt::format("{} behind sharding_indexed is not supported", in_quotes(name)));
            if (name == "bytes" || name == "endian") {
                if (bytes) fail("codecs", "bytes is there twice");
                bytes = true;
                array_.stored.big_endian = settings.value("endian", "little") == "big";
            } else if (name == "transpose") {
                if (bytes) fail("codecs", "transpose behind bytes");
                take_transpose(settings);
            } else if (name == "sharding_indexed") {
                if (bytes) fail("codecs", "sharding_indexed behind bytes");
                take_shards(settings);
                bytes = true;
            } else if (!take_filter("codecs", name, settings, bytes)) {
                take_codec("codecs", name, settings);
                if (!bytes) fail("codecs", fmt::format("{} before bytes", in_quotes(name)));
            }
        }
        if (!bytes) fail("codecs", "bytes is missing");
    }

    void take_transpose(const Json& settings) {
        const std::size_t axes = array_.shape.size();
        const Json said = settings.value("order", Json());
        std::vector<std::size_t> order;
        // Drafts had the words that version 2 has.
        if (said == "C") order = in_turn(axes);
        if (said == "F") {
            order = in_turn(axes);
            std::reverse(order.begin(), order.end());
        }
        if (said.is_array())
            for (const Json& axis : said)
                order.push_back(axis.is_number_unsigned() ? axis.get<std::size_t>() : axes);
        std::vector<std::size_t> sorted = order;
        std::sort(sorted.begin(), sorted.end());
        if (sorted != in_turn(axes))
            fail("codecs", "transpose: expected an order that has each axis once");
        if (filters_in_order_.empty()) {
            std::vector<std::size_t> composed;
            for (const std::size_t axis : order) composed.push_back(array_.order[axis]);
            array_.order = std::move(composed);
            return;
        }
        // What was done to the numbers before depends on their order: they must be put back.
        ZarrFilter filter{
            ZarrFilter::Kind::transpose, array_.stored, array_.stored, 1, 0, order, {}};
        for (const std::size_t axis : array_.order) filter.shape.push_back(array_.chunks[axis]);
        for (const ZarrFilter& before : filters_in_order_) {
            if (before.kind == ZarrFilter::Kind::pack_bits)
                fail("codecs", "transpose behind packbits is not supported");
            if (before.kind == ZarrFilter::Kind::transpose) filter.shape = permuted(before);
        }
        filters_in_order_.push_back(std::move(filter));
    }
    /// Sides of a chunk after it was transposed.
    static std::vector<std::int64_t> permuted(const ZarrFilter& filter) {
        std::vector<std::int64_t> sides;
        for (const std::size_t axis : filter.order) sides.push_back(filter.shape[axis]);
        return sides;
    }

    void take_shards(const Json& settings) {
        if (in_shard_) fail("codecs", "shards within shards are not supported");
        if (!filters_in_order_.empty())
            fail("codecs", "filters before sharding_indexed are not supported");
        ZarrShards shards;
        shards.sides = array_.chunks;
        shards.order = array_.order;
        const auto sides = sizes("chunk_shape", settings.value("chunk_shape", Json()), 1);
        if (sides.size() != array_.shape.size())
            fail("chunk_shape", "has another number of axes than the shape");
        // Chunks of a shard are counted along its own axes.
        std::int64_t count = 1;
        for (std::size_t i = 0; i < sides.size(); ++i) {
            const std::size_t axis = array_.order[i];
            if (shards.sides[axis] % sides[i] != 0)
                fail("chunk_shape", fmt::format("a shard of {} does not divide into chunks of {}",
                                                shards.sides[axis], sides[i]));
            count = product(file_, count, shards.sides[axis] / sides[i]);
            array_.chunks[axis] = sides[i];
        }
        constexpr std::int64_t kMostChunks = 1 << 22;
        if (count > kMostChunks)
            fail("chunk_shape", fmt::format("{} chunks in a shard are not supported", count));
        const std::string where = settings.value("index_location", "end");
        if (where != "end" && where != "start") fail("index_location", "expected end or start");
        shards.index_first = where == "start";
        take_index(settings.value("index_codecs", Json()), shards);
        array_.shards = std::move(shards);
        in_shard_ = true;
        take_codecs(settings.value("codecs", Json()));
        in_shard_ = false;
    }
    void take_index(const Json& codecs, ZarrShards& shards) const {
        if (!codecs.is_array()) fail("index_codecs", "expected a list of codecs");
        bool bytes = false;
        for (const Json& each : codecs) {
            const auto [name, settings] = codec_of(each);
            if (name == "bytes" && !bytes) {
                bytes = true;
                shards.index_big_endian = settings.value("endian", "little") == "big";
            } else if (name == "crc32c" && bytes && !shards.index_summed) {
                shards.index_summed = true;
            } else {
                fail("index_codecs", fmt::format("{} is not supported; expected bytes, then crc32c",
                                                 in_quotes(name)));
            }
        }
        if (!bytes) fail("index_codecs", "bytes is missing");
    }

    /// @return false  it is no filter of numbers
    bool take_filter(const char* field, const std::string& name, const Json& settings,
                     bool packed) {
        std::string problem;
        auto filter = zarr_filter(name, settings, array_.stored, problem);
        if (!problem.empty()) fail(field, fmt::format("{}: {}", in_quotes(name), problem));
        if (!filter) return false;
        if (packed)
            fail(field,
                 fmt::format("{} behind a codec of bytes is not supported", in_quotes(name)));
        array_.stored = filter->stored;
        filters_in_order_.push_back(std::move(*filter));
        return true;
    }

    void take_codec(const char* field, const std::string& name, const Json& settings) {
        std::string problem;
        const std::optional<ZarrCodec> codec = zarr_codec(name, settings, problem);
        if (!codec)
            fail(field,
                 fmt::format("{} {}", in_quotes(name),
                             problem.empty() ? "is not supported; expected blosc, zstd, zlib, "
                                               "gzip, bz2, lzma, lz4, shuffle, delta, "
                                               "fixedscaleoffset, quantize, astype or packbits"
                                             : ": " + problem));
        array_.codecs.push_back(*codec);
    }
    /// So far they are as they were applied.
    void end_codecs() {
        std::reverse(array_.codecs.begin(), array_.codecs.end());
        std::reverse(filters_in_order_.begin(), filters_in_order_.end());
        array_.filters = std::move(filters_in_order_);
    }

    /// "<u2", "float32" ...
    void take_type(const char* field, const std::string& name) {
        const std::optional<ZarrNumber> number = zarr_number(name);
        if (!number) fail(field, fmt::format("{} is not supported", in_quotes(name)));
        array_.stored = *number;
        const bool has_sign = number->kind == 'i';
        switch (number->bytes) {
            case 1:
                array_.type = has_sign ? Type::i8 : Type::u8;
                break;
            case 2:
                array_.type = number->is_float() ? Type::f16 : has_sign ? Type::i16 : Type::u16;
                break;
            case 4:
                array_.type = number->is_float() ? Type::f32 : has_sign ? Type::i32 : Type::u32;
                break;
            default:
                array_.type = Type::f64;
                if (!number->is_float())
                    array_.wide = has_sign ? Wide::with_sign : Wide::without_sign;
        }
    }

    /// "0x7fc00000": the bits of a float, the highest first.
    bool take_bits(const std::string& text) {
        if (!text.starts_with("0x") && !text.starts_with("0X")) return false;
        std::uint64_t bits = 0;
        const char* end = text.data() + text.size();
        const auto [at, error] = std::from_chars(text.data() + 2, end, bits, 16);
        const std::size_t bytes = array_.width();
        if (error != std::errc() || at != end || is_integer(array_.type) ||
            array_.wide != Wide::no || text.size() != 2 + 2 * bytes)
            fail("fill_value",
                 fmt::format("{} is not of type {}", in_quotes(text), name_of(array_.type)));
        for (std::size_t i = 0; i < bytes; ++i)
            array_.fill[std::endian::native == std::endian::little ? i : bytes - 1 - i] =
                static_cast<std::byte>(bits >> 8 * i & 0xff);
        return true;
    }
    /// Numbers as texts, as some writers have them.
    Json number_of(const Json& fill) const {
        if (!fill.is_string()) return fill;
        const std::string text = fill.get<std::string>();
        if (const auto whole = to_integer(text)) return *whole;
        if (text != "NaN" && text != "Infinity" && text != "-Infinity")
            if (const auto number = to_double(text)) return *number;
        return fill;
    }

    /// The number that missing chunks hold.
    void take_fill() {
        array_.fill.assign(array_.width(), std::byte{0});
        const Json said = json_.value("fill_value", Json());
        if (said.is_null()) return;
        if (said.is_string() && take_bits(said.get<std::string>())) return;
        const Json fill = number_of(said);
        if (array_.wide != Wide::no) {
            const bool whole = fill.is_number_float() && std::abs(fill.get<double>()) < 9e18 &&
                               fill.get<double>() == std::round(fill.get<double>());
            if (!fill.is_number_integer() && !whole) fail("fill_value", "expected a whole number");
            if (whole) return put(static_cast<std::int64_t>(fill.get<double>()));
            return put(fill.is_number_unsigned()
                           ? fill.get<std::uint64_t>()
                           : static_cast<std::uint64_t>(fill.get<std::int64_t>()));
        }
        double value = 0;
        if (fill.is_boolean())
            value = fill.get<bool>() ? 1 : 0;
        else if (fill.is_number())
            value = fill.get<double>();
        else if (fill == "NaN")
            value = std::numeric_limits<double>::quiet_NaN();
        else if (fill == "Infinity")
            value = std::numeric_limits<double>::infinity();
        else if (fill == "-Infinity")
            value = -std::numeric_limits<double>::infinity();
        else
            fail("fill_value",
                 "expected a number, NaN, Infinity, -Infinity or the bits of a "
                 "float, as 0x7fc00000");
        if (is_integer(array_.type)) {
            const auto [least, most] = limits_of(array_.type);
            if (!(value >= least && value <= most) || value != std::round(value))
                fail("fill_value",
                     fmt::format("{} is not of type {}", value, name_of(array_.type)));
        }
        switch (array_.type) {
            case Type::f16:
                return put(float_to_half(static_cast<float>(value)));
            case Type::f32:
                return put(static_cast<float>(value));
            case Type::f64:
                return put(value);
            case Type::c64:
                fail("data_type", "complex samples are not supported");
            case Type::u8:
                return put(static_cast<std::uint8_t>(value));
            case Type::i8:
                return put(static_cast<std::int8_t>(value));
            case Type::u16:
                return put(static_cast<std::uint16_t>(value));
            case Type::i16:
                return put(static_cast<std::int16_t>(value));
            case Type::u32:
                return put(static_cast<std::uint32_t>(value));
            case Type::i32:
                return put(static_cast<std::int32_t>(value));
        }
    }
    template <class T>
    void put(T value) {
        std::memcpy(array_.fill.data(), &value, std::min(sizeof value, array_.fill.size()));
    }

    std::string file_;
    const Json& json_;
    ZarrArray array_;
    std::vector<ZarrFilter> filters_in_order_;
    bool in_shard_ = false;
};

}  // namespace

bool is_zarr_node(const ZarrStore& store, const std::string& key) {
    for (const char* name : {".zattrs", ".zgroup", ".zarray", kZarrVersion3})
        if (store.has_file(zarr_key(key, name))) return true;
    return false;
}

ZarrNode zarr_node_of(const ZarrStore& store, const std::string& key) {
    ZarrNode node;
    if (const Json json = json_in(store, key, kZarrVersion3); !json.is_null()) {
        node.version3 = true;
        if (json.value("node_type", "") == "array") node.array = json;
        if (const auto found = json.find("attributes"); found != json.end())
            node.attributes = *found;
        // From 0.5 on all of OME's is in one place.
        if (node.attributes.is_object() && node.attributes.contains("ome"))
            node.attributes = Json(node.attributes["ome"]);
        return node;
    }
    node.array = json_in(store, key, ".zarray");
    node.attributes = json_in(store, key, ".zattrs");
    return node;
}

ZarrArray zarr_array_of(std::shared_ptr<const ZarrStore> store, const std::string& key,
                        const ZarrNode& node) {
    return ArrayParser(std::move(store), key, node).take();
}

}  // namespace edgewise::store
