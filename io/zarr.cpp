// OME-Zarr (OME-NGFF 0.1 to 0.5) and plain arrays of Zarr 2 and 3 in a folder: an array is cut into
// chunks, each a file of its own; an image is the same array at several resolutions.
// Moore et al., OME-Zarr: a cloud-optimized bioimaging file format, Histochem. Cell Biol. 160
// (2023).

#include "io/zarr.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <tbb/parallel_for.h>
#include <utility>

#include "graph/errors.hpp"
#include "io/channel_colours.hpp"
#include "io/geometry.hpp"
#include "io/number_streams.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"
#include "io/zarr_codecs.hpp"

namespace edgewise::store {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* kVersion3 = "zarr.json";
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

/// What describes a group or array, whatever the version.
struct Node {
    Json array;       // null: a group
    Json attributes;  // object, or null
    bool version3 = false;

    bool has(const char* name) const { return attributes.is_object() && attributes.contains(name); }
};

Node node_of(const std::string& folder) {
    Node node;
    if (const Json json = json_in(folder, kVersion3); !json.is_null()) {
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

/// Reads the fields of an array's description.
class ArrayParser {
 public:
    ArrayParser(const std::string& folder, const Node& node)
        : file_(folder + "/" + (node.version3 ? kVersion3 : ".zarray")), json_(node.array) {
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

/// One resolution of an image.
struct Level {
    std::string folder;
    std::vector<double> scale, move;  // one an axis
};

/// An image: its axes, slowest first, and its resolutions, finest first.
struct Image {
    struct Named {
        Axis::Kind kind;
        std::string unit;
    };
    std::vector<Named> axes;
    std::vector<Level> levels;
};

/// Axes that nobody names, as version 0.1 and 0.2 have them.
std::vector<Image::Named> usual_axes(const std::string& folder, std::size_t count) {
    const std::vector<Axis::Kind> kinds[] = {
        {Axis::x},
        {Axis::y, Axis::x},
        {Axis::z, Axis::y, Axis::x},
        {Axis::channel, Axis::z, Axis::y, Axis::x},
        {Axis::time, Axis::channel, Axis::z, Axis::y, Axis::x}};
    if (count < 1 || count > std::size(kinds))
        refuse(folder, fmt::format("{} axes are not supported", count));
    std::vector<Image::Named> axes;
    for (const Axis::Kind kind : kinds[count - 1]) axes.push_back({kind, ""});
    return axes;
}

std::vector<Image::Named> axes_of(const std::string& folder, const Json& json) {
    const std::pair<const char*, Axis::Kind> names[] = {
        {"x", Axis::x}, {"y", Axis::y}, {"z", Axis::z}, {"c", Axis::channel}, {"t", Axis::time}};
    std::vector<Image::Named> axes;
    for (const Json& axis : json) {
        // Version 0.3 has names alone.
        const bool plain = axis.is_string();
        const std::string name = plain              ? axis.get<std::string>()
                                 : axis.is_object() ? axis.value("name", "")
                                                    : "";
        const std::string type = plain || !axis.is_object() ? "" : axis.value("type", "");
        const auto found = std::find_if(std::begin(names), std::end(names), [&](const auto& known) {
            return lower(name) == known.first ||
                   (type == "channel" && known.second == Axis::channel) ||
                   (type == "time" && known.second == Axis::time);
        });
        if (found == std::end(names))
            refuse(folder, fmt::format("field 'axes': '{}' is not known; expected x, y, z, c or t",
                                       shown(name)));
        axes.push_back({found->second, plain ? "" : axis.value("unit", "")});
    }
    return axes;
}

/// Numbers of one transform of `scale` or `translation`, one an axis.
std::vector<double> numbers_in(const std::string& folder, const Json& json, const std::string& kind,
                               std::size_t axes) {
    const Json list = json.value(kind, Json());
    std::vector<double> numbers;
    for (const Json& number : list) {
        if (!number.is_number())
            refuse(folder,
                   fmt::format("field 'coordinateTransformations': {} holds no numbers", kind));
        numbers.push_back(number.get<double>());
    }
    if (numbers.size() != axes)
        refuse(folder,
               fmt::format("field 'coordinateTransformations': {} has {} numbers for {} axes", kind,
                           numbers.size(), axes));
    return numbers;
}

/// Transforms one after another: places are scale * index + move.
void take_transforms(const std::string& folder, const Json& transforms, Level& level) {
    if (!transforms.is_array()) return;
    for (const Json& transform : transforms) {
        const std::string type = transform.is_object() ? transform.value("type", "") : "";
        if (type == "identity") continue;
        if (type != "scale" && type != "translation")
            refuse(folder, fmt::format("field 'coordinateTransformations': '{}' is not supported; "
                                       "expected scale or translation",
                                       shown(type)));
        const std::vector<double> numbers = numbers_in(folder, transform, type, level.scale.size());
        for (std::size_t axis = 0; axis < numbers.size(); ++axis) {
            if (type == "scale") {
                level.scale[axis] *= numbers[axis];
                level.move[axis] *= numbers[axis];
            } else {
                level.move[axis] += numbers[axis];
            }
        }
    }
}

/// A folder that the metadata name, inside their own.
std::string inside(const std::string& folder, const std::string& name) {
    const fs::path path(name);
    const bool climbs =
        std::any_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
    if (name.empty() || path.is_absolute() || climbs)
        refuse(folder, fmt::format("field 'path': {} is not a folder inside", in_quotes(name)));
    const std::string whole = folder + "/" + name;
    if (!fs::is_directory(whole))
        refuse(folder, fmt::format("field 'path': {} is missing", in_quotes(name)));
    return whole;
}

Image image_of(const std::string& folder, const Json& multiscales) {
    if (!multiscales.is_array() || multiscales.empty() || !multiscales[0].is_object())
        refuse(folder, "field 'multiscales': expected a list of images");
    const Json& first = multiscales[0];
    const Json datasets = first.value("datasets", Json::array());
    if (!datasets.is_array() || datasets.empty()) refuse(folder, "field 'datasets': is empty");
    Image image;
    if (first.contains("axes")) image.axes = axes_of(folder, first["axes"]);
    for (const Json& dataset : datasets) {
        Level level;
        level.folder = inside(folder, dataset.is_object() ? dataset.value("path", "") : "");
        if (image.axes.empty()) {
            const Json shape = node_of(level.folder).array.value("shape", Json::array());
            image.axes = usual_axes(folder, shape.size());
        }
        level.scale.assign(image.axes.size(), 1);
        level.move.assign(image.axes.size(), 0);
        take_transforms(folder, dataset.value("coordinateTransformations", Json()), level);
        take_transforms(folder, first.value("coordinateTransformations", Json()), level);
        image.levels.push_back(std::move(level));
    }
    return image;
}

/// Extent of an array along x, y and z.
Extent extent_of(const std::vector<Image::Named>& axes, const std::vector<std::int64_t>& shape) {
    Extent extent{1, 1, 1};
    for (std::size_t i = 0; i < axes.size(); ++i)
        if (axes[i].kind <= Axis::z) extent[axes[i].kind] = shape[i];
    return extent;
}

/// Spacing and origin, in millimetres where the file has a unit.
void take_lengths(Header& header, const Image& image, const Level& level) {
    bool known = true;
    for (const Image::Named& axis : image.axes) {
        if (axis.kind > Axis::z) continue;
        known = known && millimetres(axis.unit) > 0;
        if (!axis.unit.empty() && !(millimetres(axis.unit) > 0))
            header.warnings.push_back(fmt::format("{}: field 'axes': the unit {} is not known",
                                                  header.file, in_quotes(axis.unit)));
    }
    for (std::size_t i = 0; i < image.axes.size(); ++i) {
        const Image::Named& axis = image.axes[i];
        if (axis.kind > Axis::z) continue;
        const double unit = known ? millimetres(axis.unit) : 1;
        const auto k = static_cast<std::size_t>(axis.kind);
        header.spacing[k] = without_noise(level.scale[i] * unit);
        header.origin[k] = level.move[i] * unit;
        if (known) header.unit = "mm", header.file_unit = unit;
    }
    check_spacing(header, "scale");
}

/// Reads chunks and puts their numbers where they belong.
class ZarrReader : public Reader {
 public:
    ZarrReader(ZarrArray array, std::vector<Image::Named> axes)
        : array_(std::move(array)), axes_(std::move(axes)) {}

    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<std::string>& warnings) const override {
        const Target target{header, pick, into, loaded_channels(header, pick)};
        const std::vector<std::int64_t> counts = chunk_counts(pick);
        std::int64_t all = 1;
        for (const std::int64_t count : counts) all *= count;
        Rounding rounding;
        std::mutex telling;
        tbb::parallel_for(std::int64_t{0}, all, [&](std::int64_t number) {
            Rounding here;
            put_chunk(chunk_at(number, counts, pick), target, here);
            const std::lock_guard lock(telling);
            rounding.rounded += here.rounded;
            rounding.beyond += here.beyond;
        });
        rounding.tell(header.file, array_.type, warnings);
    }

    /// Chunks come and go without their folder's knowing.
    std::optional<std::vector<std::string>> files() const override { return std::nullopt; }

    /// Numbers of 64 bits become a type that holds all that the array has.
    void narrow(Header& header) {
        if (array_.wide == Wide::no) return;
        WideRange range(array_.wide);
        const std::vector<std::int64_t> counts = chunk_counts({});
        std::int64_t all = 1;
        for (const std::int64_t count : counts) all *= count;
        for (std::int64_t number = 0; number < all; ++number) {
            const std::vector<std::int64_t> chunk = chunk_at(number, counts, {});
            const Bytes bytes = chunk_bytes(chunk, header.file);
            each_run(chunk, {}, [&](const std::int64_t* /*at*/, std::size_t from, std::int64_t n) {
                range.take(bytes.data() + 8 * from, static_cast<std::size_t>(n));
            });
        }
        take_narrowed(header, range.narrowed());
        array_.type = header.type;
    }

 private:
    struct Target {
        const Header& header;
        const Selection& pick;
        std::span<std::byte> into;
        std::int64_t channels;  // in memory
    };

    /// The only index that is read along an axis, or -1: all are.
    std::int64_t only(std::size_t axis, const Selection& pick) const {
        if (axes_[axis].kind == Axis::time)
            return pick.time.value_or(array_.shape[axis] > 1 ? -1 : 0);
        if (axes_[axis].kind == Axis::channel && pick.channel) return *pick.channel;
        return -1;
    }
    /// How many chunks are read along each axis.
    std::vector<std::int64_t> chunk_counts(const Selection& pick) const {
        std::vector<std::int64_t> counts;
        for (std::size_t i = 0; i < axes_.size(); ++i)
            counts.push_back(only(i, pick) >= 0
                                 ? 1
                                 : (array_.shape[i] + array_.chunks[i] - 1) / array_.chunks[i]);
        return counts;
    }
    std::vector<std::int64_t> chunk_at(std::int64_t number, const std::vector<std::int64_t>& counts,
                                       const Selection& pick) const {
        std::vector<std::int64_t> chunk(counts.size());
        for (std::size_t i = counts.size(); i-- > 0; number /= counts[i]) {
            const std::int64_t index = only(i, pick);
            chunk[i] = index >= 0 ? index / array_.chunks[i] : number % counts[i];
        }
        return chunk;
    }

    /// Decoded numbers in native byte order.
    Bytes chunk_bytes(const std::vector<std::int64_t>& chunk, const std::string& file) const {
        const std::string path = fmt::format("{}/{}{}", array_.folder, array_.prefix,
                                             fmt::join(chunk, array_.separator));
        Bytes bytes;
        if (fs::exists(path)) {
            try {
                bytes = decoded(path, array_.codecs, array_.chunk_bytes());
            } catch (const InputError& error) {
                refuse(file, error.what());
            }
        } else {
            bytes.resize(array_.chunk_bytes());
            for (std::size_t at = 0; at < bytes.size(); at += array_.fill.size())
                std::memcpy(bytes.data() + at, array_.fill.data(), array_.fill.size());
        }
        if (array_.big_endian && array_.width() > 1)
            swap_bytes(bytes.data(), array_.width(),
                       static_cast<std::int64_t>(bytes.size() / array_.width()));
        return bytes;
    }

    /// Calls run(index of the first, its place in the chunk, how many) for numbers of a chunk that
    /// lie in the array and are read, one after another in the chunk.
    template <class Run>
    void each_run(const std::vector<std::int64_t>& chunk, const Selection& pick, Run run) const {
        const std::size_t axes = axes_.size();
        // The axis along which numbers of a chunk are neighbours.
        const std::size_t fastest = array_.first_is_fastest ? 0 : axes - 1;
        std::vector<std::int64_t> low(axes), high(axes), stride(axes);
        std::int64_t step = 1;
        for (std::size_t k = 0; k < axes; ++k) {
            const std::size_t i = array_.first_is_fastest ? k : axes - 1 - k;
            stride[i] = step;
            step *= array_.chunks[i];
            low[i] = chunk[i] * array_.chunks[i];
            high[i] = std::min(low[i] + array_.chunks[i], array_.shape[i]);
            if (const std::int64_t index = only(i, pick); index >= 0)
                low[i] = index, high[i] = index + 1;
        }
        std::vector<std::int64_t> at = low;
        for (;;) {
            std::int64_t from = 0;
            for (std::size_t i = 0; i < axes; ++i)
                from += (at[i] - chunk[i] * array_.chunks[i]) * stride[i];
            run(at.data(), static_cast<std::size_t>(from), high[fastest] - low[fastest]);
            std::size_t i = 0;
            for (; i < axes; ++i) {
                if (i == fastest) continue;
                if (++at[i] < high[i]) break;
                at[i] = low[i];
            }
            if (i == axes) return;
        }
    }

    void put_chunk(const std::vector<std::int64_t>& chunk, const Target& target,
                   Rounding& rounding) const {
        Bytes bytes = chunk_bytes(chunk, target.header.file);
        if (array_.wide != Wide::no) {
            Bytes narrowed(bytes.size() / 8 * bytes_of(array_.type));
            narrow_numbers(bytes.data(), bytes.size() / 8, array_.wide, array_.type,
                           narrowed.data());
            bytes = std::move(narrowed);
        }
        const Extent& extent = target.header.extent;
        const std::int64_t strides[] = {target.channels, target.channels * extent.x,
                                        target.channels * extent.x * extent.y};
        const Type out = loaded_type(array_.type, target.pick.as_stored);
        const std::size_t width = bytes_of(array_.type), out_width = bytes_of(out);
        const std::size_t fastest = array_.first_is_fastest ? 0 : axes_.size() - 1;
        const auto stride_of = [&](std::size_t i) -> std::int64_t {
            const Axis::Kind kind = axes_[i].kind;
            if (kind <= Axis::z) return strides[kind];
            return kind == Axis::channel && !target.pick.channel ? 1 : 0;
        };
        each_run(chunk, target.pick, [&](const std::int64_t* at, std::size_t from, std::int64_t n) {
            std::int64_t to = 0;
            for (std::size_t i = 0; i < axes_.size(); ++i) to += at[i] * stride_of(i);
            const std::int64_t stride = stride_of(fastest);
            std::byte* place = target.into.data() + static_cast<std::size_t>(to) * out_width;
            const std::byte* numbers = bytes.data() + from * width;
            if (out != array_.type) {
                rounding.convert(array_.type, numbers, n, place, stride);
            } else if (stride == 1) {
                std::memcpy(place, numbers, static_cast<std::size_t>(n) * width);
            } else {
                for (std::int64_t k = 0; k < n; ++k)
                    std::memcpy(place + static_cast<std::size_t>(k * stride) * width,
                                numbers + static_cast<std::size_t>(k) * width, width);
            }
        });
    }

    ZarrArray array_;
    std::vector<Image::Named> axes_;  // slowest first
};

/// The level's array, as an image of one resolution would have it.
Header described(const std::string& path, const Image& image, std::size_t index) {
    const Level& level = image.levels[index];
    const Node node = node_of(level.folder);
    if (node.array.is_null()) refuse(path, fmt::format("{}: holds no array", level.folder));
    ZarrArray array = ArrayParser(level.folder, node).take();
    if (array.shape.size() != image.axes.size())
        refuse(path, fmt::format("{} axes are named, and the array has {}", image.axes.size(),
                                 array.shape.size()));
    Header header;
    header.file = path;
    header.format = "OME-Zarr";
    Stored stored;
    stored.type = array.type;
    stored.wide = array.wide;
    for (std::size_t i = array.shape.size(); i-- > 0;)
        stored.axes.push_back({image.axes[i].kind, array.shape[i]});
    take_axes(header, stored);
    header.volume = header.extent.z > 1;
    take_lengths(header, image, level);
    header.reading_bytes = 4 * array.chunk_bytes() + (1 << 20);
    auto reader = std::make_shared<ZarrReader>(std::move(array), image.axes);
    reader->narrow(header);
    header.reader = std::move(reader);
    return header;
}

/// Images that lie side by side in a folder, as converters of microscopes write them.
std::string one_of(const std::string& path, const Selection& pick) {
    std::vector<std::string> all;
    while (fs::is_directory(path + "/" + std::to_string(all.size())))
        all.push_back(path + "/" + std::to_string(all.size()));
    if (all.empty()) refuse(path, "holds no image: folder 0 is missing");
    if (all.size() == 1 && !pick.series) return all[0];
    const auto chosen = pick.series ? to_integer(*pick.series) : std::nullopt;
    if (!chosen || *chosen < 0 || *chosen >= static_cast<std::int64_t>(all.size()))
        throw RequestError(fmt::format("{}: holds {} images, choose one with --series 0 ... {}",
                                       path, all.size(), all.size() - 1));
    return all[static_cast<std::size_t>(*chosen)];
}

/// The image or array that is meant, and its folder.
std::pair<Node, std::string> found_in(const std::string& folder, const Selection& pick) {
    std::string path = folder;
    while (path.size() > 1 && path.ends_with('/')) path.pop_back();
    Node node = node_of(path);
    if (node.has("plate") || node.has("well"))
        refuse(folder, "is a plate or a well of many images: name the folder of one");
    if (node.array.is_null() && !node.has("multiscales")) {
        path = one_of(path, pick);
        node = node_of(path);
    }
    return {std::move(node), std::move(path)};
}

Header inspected(const std::string& folder, const Selection& pick) {
    const auto [node, path] = found_in(folder, pick);
    Image image;
    if (!node.array.is_null()) {
        const Json shape = node.array.value("shape", Json::array());
        image.axes = usual_axes(path, shape.size());
        image.levels.push_back({path, std::vector<double>(image.axes.size(), 1),
                                std::vector<double>(image.axes.size(), 0)});
    } else if (node.has("multiscales")) {
        image = image_of(path, node.attributes["multiscales"]);
    } else {
        refuse(folder, "is a Zarr group without an image: field 'multiscales' is missing");
    }
    const std::size_t count = image.levels.size();
    const int level = pick.level.value_or(0);
    if (count == 1 && level != 0)
        throw RequestError(
            fmt::format("{}: --level {}: it holds one resolution, 0", folder, level));
    if (level < 0 || static_cast<std::size_t>(level) >= count)
        throw RequestError(
            fmt::format("{}: --level {}: it holds resolutions 0 to {}", folder, level, count - 1));
    Header header = described(path, image, static_cast<std::size_t>(level));
    header.file = folder;
    header.labels = node.has("image-label");
    header.level = level;
    for (const Level& each : image.levels) {
        const Node array = node_of(each.folder);
        if (array.array.is_null()) refuse(folder, fmt::format("{}: holds no array", each.folder));
        const std::vector<std::int64_t> shape = ArrayParser(each.folder, array).take().shape;
        if (shape.size() == image.axes.size())
            header.levels.push_back(extent_of(image.axes, shape));
    }
    return header;
}

}  // namespace

bool is_zarr(const std::string& folder) {
    for (const char* name : {".zattrs", ".zgroup", ".zarray", kVersion3})
        if (fs::exists(folder + "/" + name)) return true;
    return false;
}

std::vector<std::optional<Colour>> zarr_colours(const std::string& folder, const Selection& pick) {
    std::vector<std::optional<Colour>> colours;
    try {
        const auto [node, path] = found_in(folder, pick);
        if (!node.has("omero")) return colours;
        for (const Json& channel : node.attributes["omero"].value("channels", Json::array()))
            colours.push_back(colour_of(channel.value("color", "")));
    } catch (const Json::exception&) {
        colours.clear();  // it says none that can be read
    }
    return colours;
}

Header inspect_zarr(const std::string& folder, const Selection& pick) {
    try {
        return inspected(folder, pick);
    } catch (const Json::exception& error) {
        // A field of another type than expected.
        refuse(folder, fmt::format("its description: {}", shown(error.what())));
    }
}

}  // namespace edgewise::store
