// PNG by libpng: 8 and 16 bits, one to four channels; colour chunks, ICC profile and EXIF are kept.

#include <array>
#include <bit>
#include <cstring>
#include <fmt/format.h>
#include <png.h>

#include "graph/errors.hpp"
#include "io/picture.hpp"
#include "io/png_data.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::array<unsigned char, 8> kSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::size_t kLongestKept = 16 << 20;

std::uint32_t big_endian(const std::byte* at) noexcept {
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value = value << 8 | std::to_integer<std::uint32_t>(at[i]);
    return value;
}

struct Chunk {
    std::string name;
    std::uint64_t at;  // of its data
    std::uint32_t length;
};

/// @throws InputError a chunk that leaves the file, no IHDR at the start, no IEND at the end
std::vector<Chunk> chunks_of(const File& file) {
    std::byte head[8];
    if (file.read_some(0, head) != 8 || std::memcmp(head, kSignature.data(), 8) != 0)
        refuse(file.path(), "not PNG: wrong signature");
    std::vector<Chunk> chunks;
    for (std::uint64_t at = 8;;) {
        file.read(at, head, "a chunk");
        const std::uint32_t length = big_endian(head);
        const std::string name(reinterpret_cast<const char*>(head + 4), 4);
        if (length > 0x7fffffff || at + 12 + length > file.size())
            refuse(file.path(),
                   fmt::format("chunk '{}' at byte {} claims {} bytes, the file has {}",
                               shown(name), at, length, file.size()));
        chunks.push_back({name, at + 8, length});
        if (name == "IEND") break;
        at += 12 + length;
    }
    if (chunks[0].name != "IHDR" || chunks[0].length != 13)
        refuse(file.path(), "the first chunk is not IHDR");
    return chunks;
}

struct Shape {
    std::int64_t width, height;
    int bits, colour, channels;
    bool interlaced;
};

Shape shape_of(const File& file, const std::vector<Chunk>& chunks) {
    std::byte ihdr[13];
    file.read(chunks[0].at, ihdr, "IHDR");
    Shape shape{big_endian(ihdr),
                big_endian(ihdr + 4),
                std::to_integer<int>(ihdr[8]),
                std::to_integer<int>(ihdr[9]),
                0,
                ihdr[12] != std::byte{0}};
    bool transparent = false;
    std::int64_t compressed = 0;
    for (const Chunk& chunk : chunks) {
        transparent |= chunk.name == "tRNS";
        if (chunk.name == "IDAT") compressed += chunk.length;
    }
    const int colours = shape.colour & 2 ? 3 : 1;
    shape.channels = colours + (shape.colour & 4 || transparent ? 1 : 0);
    const int stored = shape.colour == 3 ? 1 : colours + (shape.colour & 4 ? 1 : 0);
    const std::int64_t bits = product(file.path(), product(file.path(), shape.width, shape.height),
                                      std::int64_t{shape.bits} * stored);
    if (bits / 8 > compressed * kDeflateRatio)
        refuse(file.path(), fmt::format("{} x {} pixels do not fit into {} bytes of image data",
                                        shape.width, shape.height, compressed));
    return shape;
}

[[noreturn]] void on_error(png_structp png, png_const_charp what) {
    const auto& path = *static_cast<const std::string*>(png_get_error_ptr(png));
    refuse(path, std::string("damaged PNG: ") + what);
}
[[noreturn]] void on_write_error(png_structp png, png_const_charp what) {
    throw RunError(*static_cast<const std::string*>(png_get_error_ptr(png)) + ": " + what);
}
void on_warning(png_structp, png_const_charp) {}

/// Whole from here on: errors leave libpng as exceptions, and this frees what it holds.
struct Decoder {
    png_structp png = nullptr;
    png_infop info = nullptr;
    const File& file;
    std::string path;
    std::uint64_t at = 0;

    explicit Decoder(const File& from) : file(from), path(from.path()) {
        png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &path, on_error, on_warning);
        info = png ? png_create_info_struct(png) : nullptr;
        if (!info) throw std::bad_alloc();
        png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
        png_set_chunk_malloc_max(png, kLongestKept);
        png_set_read_fn(png, this, [](png_structp p, png_bytep into, std::size_t count) {
            auto& self = *static_cast<Decoder*>(png_get_io_ptr(p));
            self.file.read(self.at, std::as_writable_bytes(std::span(into, count)), "image data");
            self.at += count;
        });
    }
    Decoder(const Decoder&) = delete;
    Decoder& operator=(const Decoder&) = delete;
    ~Decoder() { png_destroy_read_struct(&png, &info, nullptr); }
};

class PngReader : public Reader {
 public:
    PngReader(Shape shape, int orientation) : shape_(shape), orientation_(orientation) {}

    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<Message>&) const override {
        const File file(header.file);
        Decoder decoder(file);
        png_read_info(decoder.png, decoder.info);
        png_set_expand(decoder.png);  // palettes, 1 to 4 bits, tRNS
        if (header.type == Type::u16 && std::endian::native == std::endian::little)
            png_set_swap(decoder.png);
        const int passes = png_set_interlace_handling(decoder.png);
        png_read_update_info(decoder.png, decoder.info);
        const std::size_t stride = png_get_rowbytes(decoder.png, decoder.info);
        if (stride !=
            static_cast<std::size_t>(shape_.width * shape_.channels) * bytes_of(header.type))
            refuse(header.file, "damaged PNG: rows of another length than IHDR says");
        Rows rows(shape_.width, shape_.height, shape_.channels, header.type, orientation_, pick,
                  into);
        // An interlaced picture is whole only after its last pass.
        const std::int64_t kept = passes > 1 ? shape_.height : 1;
        Bytes buffer(stride * static_cast<std::size_t>(kept));
        for (int pass = 0; pass < passes; ++pass)
            for (std::int64_t y = 0; y < shape_.height; ++y) {
                std::byte* row =
                    buffer.data() + (kept > 1 ? static_cast<std::size_t>(y) * stride : 0);
                png_read_row(decoder.png, reinterpret_cast<png_bytep>(row), nullptr);
                if (pass == passes - 1) rows.put(y, row);
            }
        png_read_end(decoder.png, nullptr);
    }

    std::optional<std::vector<std::string>> files() const override {
        return std::vector<std::string>{};
    }

 private:
    Shape shape_;
    int orientation_;
};

void take_icc(Header& header, const File& file) {
    Decoder decoder(file);
    png_read_info(decoder.png, decoder.info);
    png_charp name = nullptr;
    png_bytep profile = nullptr;
    png_uint_32 length = 0;
    int method = 0;
    if (png_get_iCCP(decoder.png, decoder.info, &name, &method, &profile, &length) != 0) {
        const auto bytes = std::as_bytes(std::span(profile, length));
        header.icc.assign(bytes.begin(), bytes.end());
    }
}

struct Encoder {
    png_structp png = nullptr;
    png_infop info = nullptr;
    std::string path;

    explicit Encoder(Replacement& out) : path(out.path()) {
        png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &path, on_write_error, on_warning);
        info = png ? png_create_info_struct(png) : nullptr;
        if (!info) throw std::bad_alloc();
        png_set_write_fn(
            png, &out,
            [](png_structp p, png_bytep from, std::size_t count) {
                static_cast<Replacement*>(png_get_io_ptr(p))
                    ->write(std::as_bytes(std::span(from, count)));
            },
            [](png_structp) {});
    }
    Encoder(const Encoder&) = delete;
    Encoder& operator=(const Encoder&) = delete;
    ~Encoder() { png_destroy_write_struct(&png, &info); }
};

}  // namespace

Header inspect_png(const std::string& path) {
    const File file(path);
    const std::vector<Chunk> chunks = chunks_of(file);
    const Shape shape = shape_of(file, chunks);
    Header header;
    header.file = path;
    header.format = "PNG";
    header.type = shape.bits == 16 ? Type::u16 : Type::u8;
    header.channels = shape.channels;
    header.colour = shape.channels >= 3;
    header.alpha = shape.channels % 2 == 0 ? Alpha::straight : Alpha::none;
    for (const Chunk& chunk : chunks) {
        const bool colour = chunk.name == "gAMA" || chunk.name == "cHRM" || chunk.name == "sRGB" ||
                            chunk.name == "cICP" || chunk.name == "pHYs";
        if ((!colour && chunk.name != "eXIf") || chunk.length > kLongestKept) continue;
        Bytes bytes(chunk.length);
        file.read(chunk.at, bytes, "a chunk");
        if (colour)
            header.png_chunks.emplace_back(chunk.name, std::move(bytes));
        else
            header.exif = std::move(bytes);
    }
    const int orientation = exif_orientation(header.exif);
    set_upright(header.exif);
    take_size(header, shape.width, shape.height, orientation);
    for (const Chunk& chunk : chunks)
        if (chunk.name == "iCCP") take_icc(header, file);
    if (shape.interlaced)
        header.reading_bytes +=
            static_cast<std::size_t>(header.extent.samples() * header.channels) *
            bytes_of(header.type);
    header.reader = std::make_shared<const PngReader>(shape, orientation);
    return header;
}

void write_png(Replacement& out, const Header& what, const void* samples) {
    constexpr int kColours[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                PNG_COLOR_TYPE_RGB_ALPHA};
    Encoder encoder(out);
    const auto width = static_cast<png_uint_32>(what.extent.x),
               height = static_cast<png_uint_32>(what.extent.y);
    png_set_user_limits(encoder.png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_IHDR(encoder.png, encoder.info, width, height, what.type == Type::u16 ? 16 : 8,
                 kColours[what.channels - 1], PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    // A profile that does not fit the picture's colours would only earn a reader's warning.
    png_set_option(encoder.png, PNG_SKIP_sRGB_CHECK_PROFILE, PNG_OPTION_ON);
    if (!what.icc.empty())
        png_set_iCCP(encoder.png, encoder.info, "ICC profile", PNG_COMPRESSION_TYPE_BASE,
                     reinterpret_cast<png_const_bytep>(what.icc.data()),
                     static_cast<png_uint_32>(what.icc.size()));
    png_write_info_before_PLTE(encoder.png, encoder.info);
    for (const auto& [name, bytes] : what.png_chunks)
        png_write_chunk(encoder.png, reinterpret_cast<png_const_bytep>(name.c_str()),
                        reinterpret_cast<png_const_bytep>(bytes.data()), bytes.size());
    if (!what.exif.empty())
        png_write_chunk(encoder.png, reinterpret_cast<png_const_bytep>("eXIf"),
                        reinterpret_cast<png_const_bytep>(what.exif.data()), what.exif.size());
    png_write_info(encoder.png, encoder.info);
    // libpng compresses on one thread.
    compress_png(
        {.first = static_cast<const std::byte*>(samples),
         .stride = static_cast<std::size_t>(what.extent.x * what.channels) * bytes_of(what.type),
         .height = what.extent.y,
         .channels = what.channels,
         .bytes = static_cast<int>(bytes_of(what.type))},
        [&](std::span<const std::byte> chunk) {
            png_write_chunk(encoder.png, reinterpret_cast<png_const_bytep>("IDAT"),
                            reinterpret_cast<png_const_bytep>(chunk.data()), chunk.size());
        });
    png_write_chunk(encoder.png, reinterpret_cast<png_const_bytep>("IEND"), nullptr, 0);
}

}  // namespace edgewise::store
