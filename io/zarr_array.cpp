#include "io/zarr_array.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <limits>
#include <utility>

#include "graph/errors.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kMostText = 16 << 20;

/// A file of JSON in the folder; null where it is not there.
Json json_in(const std::string& folder, const char* name) {
    const std::string path = folder + "/" + name;
    if (!fs::exists(path)) return {};
    const File file(path);
    if (file.size() > kMostText)
        refuse(path, fmt::format("{} bytes of text are not supported", file.size()));
    const Bytes bytes = file.head(kMostText);
    const char* text = reinterpret_cast<const char*>(bytes.data());
    Json json = Json::parse(text, text + bytes.size(), nullptr, false);
    if (!json.is_object()) refuse(path, "is not a JSON object");
    return json;
}

/// Reads the fields of an array's description.
class ArrayParser {
 public:
    ArrayParser(const std::string& folder, const ZarrNode& node)
        : file_(folder + "/" + (node.version3 ? kZarrVersion3 : ".zarray")), json_(node.array) {
        array_.folder = folder;
        array_.shape = sizes("shape", json_.value("shape", Json()), 0);
        if (node.version3)
            take_version3();
        else
            take_version2();
        if (array_.chunks.size() != array_.shape.size())
            fail("chunks", "has another number of axes than the shape");
        std::int64_t bytes = static_cast<std::int64_t>(array_.width());
        for (const std::int64_t side : array_.chunks) bytes = product(file_, bytes, side);
        constexpr std::int64_t kMostBytes = std::numeric_limits<std::int32_t>::max();
        if (bytes > kMostBytes) fail("chunks", fmt::format("{} bytes are not supported", bytes));
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

    void take_version2() {
        if (json_.value("zarr_format", 0) != 2) fail("zarr_format", "expected 2");
        array_.chunks = sizes("chunks", json_.value("chunks", Json()), 1);
        const std::string dtype = text("dtype", json_.value("dtype", Json()));
        array_.big_endian = dtype.starts_with('>');
        take_type(dtype.size() > 1 ? dtype.substr(1) : "");
        if (const Json filters = json_.value("filters", Json());
            !filters.is_null() && !filters.empty())
            fail("filters", "are not supported");
        const std::string order = text("order", json_.value("order", Json("C")));
        if (order != "C" && order != "F") fail("order", "expected C or F");
        array_.first_is_fastest = order == "F";
        array_.separator =
            text("dimension_separator", json_.value("dimension_separator", Json(".")));
        if (array_.separator != "." && array_.separator != "/")
            fail("dimension_separator", "expected . or /");
        if (const Json how = json_.value("compressor", Json()); !how.is_null())
            take_codec(text("compressor", how.value("id", Json())));
        take_fill();
    }

    void take_version3() {
        if (json_.value("zarr_format", 0) != 3) fail("zarr_format", "expected 3");
        const Json grid = json_.value("chunk_grid", Json::object());
        if (grid.value("name", "") != "regular")
            fail("chunk_grid", "only regular ones are supported");
        array_.chunks =
            sizes("chunk_shape",
                  grid.value("configuration", Json::object()).value("chunk_shape", Json()), 1);
        take_type3(text("data_type", json_.value("data_type", Json())));
        const Json key = json_.value("chunk_key_encoding", Json::object());
        const std::string kind = key.value("name", "default");
        if (kind != "default" && kind != "v2") fail("chunk_key_encoding", "expected default or v2");
        if (kind == "default") array_.prefix = "c";
        array_.separator = key.value("configuration", Json::object())
                               .value("separator", kind == "default" ? "/" : ".");
        if (array_.separator != "." && array_.separator != "/")
            fail("separator", "expected . or /");
        if (!array_.prefix.empty()) array_.prefix += array_.separator;
        bool bytes = false;
        for (const Json& codec : json_.value("codecs", Json::array())) {
            const std::string name = codec.value("name", "");
            if (name == "bytes") {
                bytes = true;
                array_.big_endian =
                    codec.value("configuration", Json::object()).value("endian", "little") == "big";
            } else if (!bytes) {
                fail("codecs", fmt::format("{} before bytes is not supported", shown(name)));
            } else {
                take_codec(name);
            }
        }
        if (!bytes) fail("codecs", "bytes is missing");
        std::reverse(array_.codecs.begin(), array_.codecs.end());
        take_fill();
    }

    void take_codec(const std::string& name) {
        const std::optional<ZarrCodec> codec = zarr_codec(name);
        if (!codec)
            fail("compressor",
                 fmt::format("'{}' is not supported; expected blosc, zstd, zlib, gzip "
                             "or bz2",
                             shown(name)));
        array_.codecs.push_back(*codec);
    }

    /// "u2", "f4" ...
    void take_type(const std::string& name) {
        const std::pair<const char*, Type> types[] = {
            {"b1", Type::u8},  {"u1", Type::u8},  {"i1", Type::i8},  {"u2", Type::u16},
            {"i2", Type::i16}, {"u4", Type::u32}, {"i4", Type::i32}, {"f2", Type::f16},
            {"f4", Type::f32}, {"f8", Type::f64}, {"u8", Type::f64}, {"i8", Type::f64}};
        const auto found = std::find_if(std::begin(types), std::end(types),
                                        [&](const auto& type) { return name == type.first; });
        if (found == std::end(types))
            fail("dtype", fmt::format("'{}' is not supported", shown(name)));
        array_.type = found->second;
        if (name == "u8") array_.wide = Wide::without_sign;
        if (name == "i8") array_.wide = Wide::with_sign;
    }
    /// "uint16", "float32" ...
    void take_type3(const std::string& name) {
        const std::pair<const char*, const char*> types[] = {
            {"bool", "b1"},  {"uint8", "u1"},   {"int8", "i1"},    {"uint16", "u2"},
            {"int16", "i2"}, {"uint32", "u4"},  {"int32", "i4"},   {"uint64", "u8"},
            {"int64", "i8"}, {"float16", "f2"}, {"float32", "f4"}, {"float64", "f8"}};
        for (const auto& [full, brief] : types)
            if (name == full) return take_type(brief);
        fail("data_type", fmt::format("'{}' is not supported", shown(name)));
    }

    /// The number that missing chunks hold.
    void take_fill() {
        const Json fill = json_.value("fill_value", Json());
        array_.fill.assign(array_.width(), std::byte{0});
        if (fill.is_null()) return;
        if (array_.wide != Wide::no) {
            if (!fill.is_number_integer()) fail("fill_value", "expected a whole number");
            put(fill.is_number_unsigned() ? fill.get<std::uint64_t>()
                                          : static_cast<std::uint64_t>(fill.get<std::int64_t>()));
            return;
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
            fail("fill_value", "expected a number, NaN, Infinity or -Infinity");
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
        if (array_.big_endian) swap_bytes(array_.fill.data(), array_.fill.size(), 1);
    }

    std::string file_;
    const Json& json_;
    ZarrArray array_;
};

}  // namespace

ZarrNode zarr_node_of(const std::string& folder) {
    ZarrNode node;
    if (const Json json = json_in(folder, kZarrVersion3); !json.is_null()) {
        node.version3 = true;
        if (json.value("node_type", "") == "array") node.array = json;
        if (const auto found = json.find("attributes"); found != json.end())
            node.attributes = *found;
        // From 0.5 on all of OME's is in one place.
        if (node.attributes.is_object() && node.attributes.contains("ome"))
            node.attributes = Json(node.attributes["ome"]);
        return node;
    }
    node.array = json_in(folder, ".zarray");
    node.attributes = json_in(folder, ".zattrs");
    return node;
}

ZarrArray zarr_array_of(const std::string& folder, const ZarrNode& node) {
    return ArrayParser(folder, node).take();
}

}  // namespace edgewise::store
