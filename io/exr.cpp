// OpenEXR. Reading checks the header here and decodes by OpenImageIO; writing is scan lines in
// blocks of 16 under deflate (OpenEXR file layout, openexr.com).

#include <bit>
#include <cstring>
#include <fmt/format.h>
#include <zlib.h>

#include "graph/errors.hpp"
#include "io/module.hpp"
#include "io/picture.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint64_t kLongestHeader = 16 << 20;
constexpr std::int64_t kBlockRows = 16;  // of ZIP_COMPRESSION
constexpr std::uint32_t kManyParts = 0x1000, kDeep = 0x800;

struct Channel {
    std::string name;
    std::uint32_t type = 0, x = 1, y = 1;  // type: 0 unsigned, 1 half, 2 float
};

struct Shape {
    std::vector<Channel> channels;
    std::int32_t data[4] = {0, 0, -1, -1}, display[4] = {0, 0, -1, -1};
    bool plain = true;  // one part, not deep
};

/// Little-endian numbers and names of a header, never beyond its end.
class Cursor {
 public:
    Cursor(const std::string& path, std::span<const std::byte> bytes)
        : path_(path), bytes_(bytes) {}
    std::uint32_t number() {
        need(4);
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < 4; ++i)
            value |= std::to_integer<std::uint32_t>(bytes_[at_ + i]) << 8 * i;
        at_ += 4;
        return value;
    }
    std::string name() {
        std::string text;
        for (;;) {
            need(1);
            const char c = static_cast<char>(bytes_[at_++]);
            if (c == 0) return text;
            text += c;
            if (text.size() > 255)
                refuse(path_, "damaged EXR header: a name longer than 255 bytes");
        }
    }
    Cursor part(std::size_t count) {
        need(count);
        at_ += count;
        return {path_, bytes_.subspan(at_ - count, count)};
    }
    bool ended() const { return at_ == bytes_.size(); }

 private:
    void need(std::size_t count) const {
        if (count > bytes_.size() - at_) refuse(path_, "damaged EXR header: it ends too early");
    }
    const std::string& path_;
    std::span<const std::byte> bytes_;
    std::size_t at_ = 0;
};

Shape shape_of(const std::string& path, std::span<const std::byte> head) {
    Shape shape;
    Cursor cursor(path, head);
    if (cursor.number() != kMagic) refuse(path, "not EXR: wrong signature");
    shape.plain = (cursor.number() & (kManyParts | kDeep)) == 0;
    for (std::string name = cursor.name(); !name.empty(); name = cursor.name()) {
        cursor.name();  // its type
        const std::uint32_t bytes = cursor.number();
        Cursor value = cursor.part(bytes);
        if (name == "dataWindow")
            for (auto& edge : shape.data) edge = static_cast<std::int32_t>(value.number());
        if (name == "displayWindow")
            for (auto& edge : shape.display) edge = static_cast<std::int32_t>(value.number());
        if (name != "channels") continue;
        for (std::string channel = value.name(); !channel.empty(); channel = value.name()) {
            Channel found{channel};
            found.type = value.number();
            value.number();  // pLinear
            found.x = value.number();
            found.y = value.number();
            shape.channels.push_back(found);
        }
    }
    return shape;
}

/// Whether the channels are what a Header can say without OpenImageIO: grey or RGB, perhaps alpha.
bool is_simple(const Shape& shape) {
    std::string names;
    for (const Channel& channel : shape.channels) {
        names += channel.name;
        if (channel.x != 1 || channel.y != 1 || channel.type != shape.channels[0].type ||
            channel.type < 1)
            return false;
    }
    return names == "Y" || names == "BGR" || names == "ABGR" || names == "AY";
}

class ExrReader : public Reader {
 public:
    explicit ExrReader(ModuleImage image) : image_(image) {}
    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<std::string>&) const override {
        if (!pick.channel || header.channels == 1)
            return module_read(Library::oiio, header.file, image_, into);
        Bytes all(into.size() * static_cast<std::size_t>(header.channels));
        module_read(Library::oiio, header.file, image_, all);
        for (std::size_t i = 0; i < into.size() / 4; ++i)
            std::memcpy(into.data() + 4 * i,
                        all.data() + 4 * (i * static_cast<std::size_t>(header.channels) +
                                          static_cast<std::size_t>(*pick.channel)),
                        4);
    }

    std::optional<std::vector<std::string>> files() const override {
        return std::vector<std::string>{};
    }

 private:
    ModuleImage image_;
};

void put(std::string& to, std::uint64_t value, std::size_t width) {
    for (std::size_t i = 0; i < width; ++i) to += static_cast<char>(value >> 8 * i);
}
void attribute(std::string& to, const char* name, const char* type, const std::string& value) {
    to.append(name).append(1, '\0').append(type).append(1, '\0');
    put(to, value.size(), 4);
    to += value;
}

/// Channels in the order of their names, with where each lies in memory.
std::vector<std::pair<std::string, int>> channels_of(int count) {
    if (count == 1) return {{"Y", 0}};
    if (count == 2) return {{"A", 1}, {"Y", 0}};
    if (count == 3) return {{"B", 2}, {"G", 1}, {"R", 0}};
    return {{"A", 3}, {"B", 2}, {"G", 1}, {"R", 0}};
}

std::string header_text(const Header& what) {
    std::string text, channels, window, zero(8, '\0'), one;
    put(text, kMagic, 4);
    put(text, 2, 4);
    for (const auto& [name, index] : channels_of(what.channels)) {
        channels.append(name).append(1, '\0');
        put(channels, what.type == Type::f16 ? 1 : 2, 4);
        put(channels, 0, 4);
        put(channels, 1, 4);
        put(channels, 1, 4);
    }
    channels += '\0';
    put(window, 0, 8);
    put(window, static_cast<std::uint64_t>(what.extent.x - 1), 4);
    put(window, static_cast<std::uint64_t>(what.extent.y - 1), 4);
    put(one, std::bit_cast<std::uint32_t>(1.0f), 4);
    attribute(text, "channels", "chlist", channels);
    attribute(text, "compression", "compression", std::string(1, '\3'));
    attribute(text, "dataWindow", "box2i", window);
    attribute(text, "displayWindow", "box2i", window);
    attribute(text, "lineOrder", "lineOrder", std::string(1, '\0'));
    attribute(text, "pixelAspectRatio", "float", one);
    attribute(text, "screenWindowCenter", "v2f", zero);
    attribute(text, "screenWindowWidth", "float", one);
    return text + '\0';
}

/// Rows [top, top + rows) as the file orders them: row by row, channel by channel.
std::string block_of(const Header& what, const std::byte* samples, std::int64_t top,
                     std::int64_t rows) {
    const std::size_t width = bytes_of(what.type);
    std::string block;
    for (std::int64_t y = top; y < top + rows; ++y)
        for (const auto& [name, index] : channels_of(what.channels))
            for (std::int64_t x = 0; x < what.extent.x; ++x) {
                char number[4];
                std::memcpy(number,
                            samples + static_cast<std::size_t>(
                                          (y * what.extent.x + x) * what.channels + index) *
                                          width,
                            width);
                if (std::endian::native == std::endian::big) std::reverse(number, number + width);
                block.append(number, width);
            }
    return block;
}

/// OpenEXR's ZIP: even bytes before odd ones, differences of neighbours, deflate. What does not
/// shrink is stored as it was.
std::string zipped(const std::string& block) {
    std::string parted;
    for (std::size_t start : {0, 1})
        for (std::size_t i = start; i < block.size(); i += 2) parted += block[i];
    int before = static_cast<unsigned char>(parted[0]);
    for (std::size_t i = 1; i < parted.size(); ++i) {
        const int here = static_cast<unsigned char>(parted[i]);
        parted[i] = static_cast<char>(here - before + 128);
        before = here;
    }
    uLongf size = compressBound(parted.size());
    std::string packed(size, '\0');
    if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                  reinterpret_cast<const Bytef*>(parted.data()), parted.size(), 4) != Z_OK)
        throw std::bad_alloc();
    packed.resize(size);
    return packed.size() < block.size() ? packed : block;
}

}  // namespace

Header inspect_exr(const std::string& path) {
    const File file(path);
    const Shape shape = shape_of(path, file.head(kLongestHeader));
    const std::int64_t width = std::int64_t{shape.data[2]} - shape.data[0] + 1;
    const std::int64_t height = std::int64_t{shape.data[3]} - shape.data[1] + 1;
    Header header;
    header.file = path;
    header.format = "EXR";
    take_size(header, width, height, 1);
    if (shape.channels.empty())
        refuse(path, "damaged EXR header: attribute 'channels' is missing or empty");
    // A block of rows takes 8 bytes of the table of offsets, and at least as much itself.
    if (height / 256 * 8 > static_cast<std::int64_t>(file.size()))
        refuse(path,
               fmt::format("{} x {} pixels do not fit into {} bytes", width, height, file.size()));
    check_density(path,
                  product(path, header.extent.samples(),
                          static_cast<std::int64_t>(4 * shape.channels.size())),
                  file.size(), kDensest);
    if (!shape.plain || !is_simple(shape)) return inspect_by_oiio(path);
    header.channels = static_cast<int>(shape.channels.size());
    header.type = shape.channels[0].type == 1 ? Type::f16 : Type::f32;
    if (header.channels % 2 == 0) header.alpha = Alpha::premultiplied;
    if (std::memcmp(shape.data, shape.display, sizeof shape.data) != 0)
        header.warnings.push_back(
            path + ": the picture differs from its display window, which is ignored");
    ModuleImage image;
    image.size[0] = width;
    image.size[1] = height;
    image.channels = header.channels;
    image.type = static_cast<int>(Type::f32);
    header.reading_bytes = bytes_of(Library::oiio) +
                           static_cast<std::size_t>(header.extent.samples() * header.channels) * 4;
    header.reader = std::make_shared<const ExrReader>(image);
    return header;
}

void write_exr(Replacement& out, const Header& what, const void* samples) {
    const auto* from = static_cast<const std::byte*>(samples);
    const std::int64_t blocks = (what.extent.y + kBlockRows - 1) / kBlockRows;
    const std::string head = header_text(what);
    out.write(std::as_bytes(std::span(head)));
    std::string table(static_cast<std::size_t>(blocks) * 8, '\0');
    out.write(std::as_bytes(std::span(table)));
    std::uint64_t at = head.size() + table.size();
    table.clear();
    for (std::int64_t top = 0; top < what.extent.y; top += kBlockRows) {
        const std::int64_t rows = std::min(kBlockRows, what.extent.y - top);
        const std::string packed = zipped(block_of(what, from, top, rows));
        std::string block;
        put(block, static_cast<std::uint64_t>(top), 4);
        put(block, packed.size(), 4);
        block += packed;
        out.write(std::as_bytes(std::span(block)));
        put(table, at, 8);
        at += block.size();
    }
    out.seek(head.size());
    out.write(std::as_bytes(std::span(table)));
}

}  // namespace edgewise::store
