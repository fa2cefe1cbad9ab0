// Samples without a header: `raw:FILE:WxHxD:TYPE[:little|big][:offset]`, and a JSON that names
// them.

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "graph/errors.hpp"
#include "io/geometry.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr int kDeepestJson = 64;
constexpr std::size_t kLongestJson = 16 << 20;

struct Description {
    std::string data;
    std::vector<std::int64_t> sizes;
    Type type = Type::u8;
    Wide wide = Wide::no;
    bool big = false;
    std::uint64_t offset = 0;
};

Header described(const std::string& file, const Description& what) {
    Header header;
    header.file = file;
    header.format = "raw";
    Stored stored;
    stored.type = what.type;
    stored.wide = what.wide;
    stored.big_endian = what.big;
    stored.pieces = {{what.data, what.offset}};
    constexpr Axis::Kind kKinds[] = {Axis::x, Axis::y, Axis::z};
    for (std::size_t i = 0; i < what.sizes.size(); ++i)
        stored.axes.push_back({kKinds[i], what.sizes[i]});
    header.volume = what.sizes.size() == 3;
    take_axes(header, stored);
    take_reader(header, std::move(stored));
    return header;
}

[[noreturn]] void bad_raw(const std::string& source, const std::string& why) {
    throw RequestError(in_quotes(source) + ": " + why +
                       "; expected raw:FILE:WxH[xD]:TYPE[:little|big][:offset]");
}

std::vector<std::int64_t> sizes_of(const std::string& source, std::string_view text) {
    std::vector<std::int64_t> sizes;
    const std::string low = lower(text);
    for (std::string_view word : split(low, 'x')) {
        const auto size = to_integer(word);
        if (!size || *size < 1) bad_raw(source, in_quotes(text) + " is no extent");
        sizes.push_back(*size);
    }
    if (sizes.size() < 2 || sizes.size() > 3)
        bad_raw(source, in_quotes(text) + " is no extent of two or three axes");
    return sizes;
}

/// JSON whose nesting is bounded: the parser is asked to stop, not trusted to survive.
nlohmann::json parsed(const std::string& path, const std::string& text) {
    bool deep = false;
    const auto watch = [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
        if (depth > kDeepestJson) {
            deep = true;
            throw std::length_error("too deep");
        }
        return true;
    };
    try {
        return nlohmann::json::parse(text, watch);
    } catch (const nlohmann::json::exception& error) {
        refuse(path, fmt::format("not JSON: {}", shown(error.what())));
    } catch (const std::length_error&) {
        refuse(path, fmt::format("JSON nested deeper than {}", kDeepestJson));
    }
}

Type json_type(const std::string& path, const nlohmann::json& json) {
    const std::string name = json.value("type", "");
    constexpr std::pair<std::string_view, Type> kNames[] = {
        {"uint8", Type::u8},    {"int8", Type::i8},     {"uint16", Type::u16},
        {"int16", Type::i16},   {"uint32", Type::u32},  {"int32", Type::i32},
        {"float16", Type::f16}, {"float32", Type::f32}, {"float64", Type::f64},
        {"float", Type::f32},   {"double", Type::f64}};
    for (const auto& [known, type] : kNames)
        if (known == name) return type;
    for (Type type : {Type::u8, Type::i8, Type::u16, Type::i16, Type::u32, Type::i32, Type::f16,
                      Type::f32, Type::f64})
        if (name_of(type) == name) return type;
    refuse(path, "field 'type' is '" + shown(name) + "': unknown");
}

Description json_description(const std::string& path, const nlohmann::json& json) {
    Description what;
    for (const auto& size : json.at("dims")) {
        if (!size.is_number_integer() || size.get<std::int64_t>() < 1)
            refuse(path,
                   "field 'dims' holds " + shown(size.dump()) + ", expected integers of 1 or more");
        what.sizes.push_back(size.get<std::int64_t>());
    }
    if (what.sizes.size() < 2 || what.sizes.size() > 3)
        refuse(path,
               fmt::format("field 'dims' has {} entries, expected 2 or 3", what.sizes.size()));
    if (const std::string type = json.value("type", ""); type == "int64" || type == "i64")
        what.type = Type::f64, what.wide = Wide::with_sign;
    else if (type == "uint64" || type == "u64")
        what.type = Type::f64, what.wide = Wide::without_sign;
    else
        what.type = json_type(path, json);
    const std::string endian = json.value("endian", "little");
    if (endian != "little" && endian != "big")
        refuse(path, "field 'endian' is '" + shown(endian) + "', expected little or big");
    what.big = endian == "big";
    if (const std::string encoding = json.value("encoding", "raw"); encoding != "raw")
        refuse(path, "field 'encoding' is '" + shown(encoding) + "', expected raw");
    const nlohmann::json offset = json.value("byte_offset", nlohmann::json(0));
    if (!offset.is_number_integer() || offset.get<std::int64_t>() < 0)
        refuse(path, "field 'byte_offset' is " + shown(offset.dump()) + ", expected 0 or more");
    what.offset = offset.get<std::uint64_t>();
    what.data = beside(path, json.at("data").get<std::string>());
    return what;
}

}  // namespace

Header inspect_json(const std::string& path) {
    const File file(path);
    if (file.size() > kLongestJson) refuse(path, "too long for the description of a raw file");
    const Bytes bytes = file.head(kLongestJson);
    const nlohmann::json json =
        parsed(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (!json.is_object()) refuse(path, "is JSON, but no object that describes a raw file");
    try {
        Header header = described(path, json_description(path, json));
        if (const auto spacing = json.find("spacing"); spacing != json.end()) {
            const auto steps = spacing->get<std::vector<double>>();
            if (steps.size() != (header.volume ? 3u : 2u))
                refuse(path, fmt::format("field 'spacing' has {} entries", steps.size()));
            std::copy(steps.begin(), steps.end(), header.spacing.begin());
            check_spacing(header, "spacing");
        }
        return header;
    } catch (const nlohmann::json::exception& error) {
        refuse(path,
               fmt::format("a field is missing or of the wrong kind: {}", shown(error.what())));
    }
}

Header inspect_raw(const std::string& source) {
    std::vector<std::string_view> parts = split(std::string_view(source).substr(4), ':');
    Description what;
    if (const auto offset = to_integer(parts.back()); offset && parts.size() > 3) {
        if (*offset < 0) bad_raw(source, "the offset is negative");
        what.offset = static_cast<std::uint64_t>(*offset);
        parts.pop_back();
    }
    if (parts.back() == "little" || parts.back() == "big") {
        what.big = parts.back() == "big";
        parts.pop_back();
    }
    if (parts.size() < 3) bad_raw(source, "parts are missing");
    what.type = type_named(parts.back());
    if (what.type == Type::c64) bad_raw(source, "complex samples are not supported");
    what.sizes = sizes_of(source, parts[parts.size() - 2]);
    // FILE may hold colons: it is all that is left of the extent.
    what.data = std::string(parts[0].data(), parts[parts.size() - 2].data() - parts[0].data() - 1);
    if (what.data.empty()) bad_raw(source, "FILE is empty");
    Header header = described(what.data, what);
    header.file = source;
    return header;
}

}  // namespace edgewise::store
