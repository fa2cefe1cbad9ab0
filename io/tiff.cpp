// TIFF and BigTIFF. Reading decodes by libtiff what tiff_directory.cpp has checked and
// tiff_layout.cpp has put in order; single pages of rare colours go to OpenImageIO. Writing is
// uncompressed.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <tiffio.h>
#include <utility>

#include "io/geometry.hpp"
#include "io/number_streams.hpp"
#include "io/picture.hpp"
#include "io/text.hpp"
#include "io/tiff_layout.hpp"

namespace edgewise::store {
namespace {

// That give plain samples: none, fax (2 to 4), LZW, JPEG, deflate, PackBits, LZMA, Zstandard.
constexpr int kCompressions[] = {1, 2, 3, 4, 5, 7, 8, 32946, 32773, 34925, 50000};
constexpr int kJpeg = 7;
constexpr int kPalette = 3, kYcbcr = 6;  // photometric
constexpr tmsize_t kLargestAllocation = tmsize_t{1} << 31;

struct Client {
    const File& file;
    std::uint64_t at = 0;
    std::string error;
};

int on_error(TIFF*, void* user, const char*, const char* format, va_list arguments) {
    char text[256];
    std::vsnprintf(text, sizeof text, format, arguments);
    static_cast<Client*>(user)->error = text;
    return 1;  // handled: nothing is printed
}
int on_warning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

tmsize_t client_read(thandle_t handle, void* into, tmsize_t bytes) {
    auto& client = *static_cast<Client*>(handle);
    const std::size_t got = client.file.read_some(
        client.at,
        {static_cast<std::byte*>(into), static_cast<std::size_t>(std::max<tmsize_t>(bytes, 0))});
    client.at += got;
    return static_cast<tmsize_t>(got);
}
toff_t client_seek(thandle_t handle, toff_t to, int whence) {
    auto& client = *static_cast<Client*>(handle);
    if (whence == SEEK_CUR) to += client.at;
    if (whence == SEEK_END) to += client.file.size();
    return client.at = to;
}

/// The type of one sample in a row that is given out, before colours.
std::optional<Type> type_of(const TiffPage& page) {
    struct Row {
        int bits, format;
        Type type;
    };
    constexpr Row kTypes[] = {{8, 1, Type::u8},   {8, 2, Type::i8},   {16, 1, Type::u16},
                              {16, 2, Type::i16}, {32, 1, Type::u32}, {32, 2, Type::i32},
                              {16, 3, Type::f16}, {32, 3, Type::f32}, {64, 3, Type::f64},
                              {64, 1, Type::f64}, {64, 2, Type::f64}};  // as in Stored
    const int format = page.format == 4 ? 1 : page.format;              // 4: not said
    if (format == 1 && page.bits < 16) return page.bits <= 8 ? Type::u8 : Type::u16;
    for (const Row& row : kTypes)
        if (row.bits == page.bits && row.format == format) return row.type;
    return std::nullopt;
}

Wide wide_of(const TiffPage& page) {
    if (page.bits != 64 || page.format == 3) return Wide::no;
    return page.format == 2 ? Wide::with_sign : Wide::without_sign;
}

bool is_plain(const TiffPage& page) {
    const bool decodes = std::find(std::begin(kCompressions), std::end(kCompressions),
                                   page.compression) != std::end(kCompressions);
    const bool fax = page.compression >= 2 && page.compression <= 4;
    const bool jpeg = page.compression == kJpeg;
    const bool palette = page.photometric == kPalette;
    if (!decodes || page.mixed || !type_of(page)) return false;
    if (fax && page.bits != 1) return false;
    if (jpeg && (page.bits != 8 || page.format == 2)) return false;
    if (palette)
        return page.samples == 1 && page.bits <= 8 &&
               page.colours.size() == std::size_t{3} << page.bits;
    if (page.photometric == kYcbcr) return jpeg && page.samples == 3;
    return page.photometric <= 2;
}

/// `count` numbers of less than a byte or between one and two, the highest bit first. Those of less
/// than a byte that are shades are stretched over the byte, as every reader of pictures does.
void unpack(const std::byte* from, std::int64_t count, int bits, bool shades, std::byte* to) {
    std::uint32_t held = 0;
    int there = 0;
    const std::uint32_t mask = (1u << bits) - 1;
    for (std::int64_t i = 0; i < count; ++i) {
        while (there < bits) {
            held = held << 8 | std::to_integer<std::uint32_t>(*from++);
            there += 8;
        }
        there -= bits;
        const std::uint32_t value = held >> there & mask;
        if (bits < 8) {
            to[i] = static_cast<std::byte>(shades ? (value * 255 + mask / 2) / mask : value);
        } else {
            const auto wide = static_cast<std::uint16_t>(value);
            std::memcpy(to + 2 * i, &wide, sizeof wide);
        }
    }
}

/// Decodes pages to rows of whole numbers, the samples of a pixel together.
class Decoder {
 public:
    explicit Decoder(const File& file) : client_{file, 0, ""} {
        TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
        TIFFOpenOptionsSetErrorHandlerExtR(options, on_error, &client_);
        TIFFOpenOptionsSetWarningHandlerExtR(options, on_warning, nullptr);
        TIFFOpenOptionsSetMaxSingleMemAlloc(options, kLargestAllocation);
        // h: only the header; the directories that are wanted are known by their offsets.
        tiff_ = TIFFClientOpenExt(
            file.path().c_str(), "rmh", &client_, client_read,
            [](thandle_t, void*, tmsize_t) -> tmsize_t { return 0; }, client_seek,
            [](thandle_t) { return 0; },
            [](thandle_t handle) -> toff_t { return static_cast<Client*>(handle)->file.size(); },
            nullptr, nullptr, options);
        TIFFOpenOptionsFree(options);
        if (!tiff_) fail();
    }
    Decoder(const Decoder&) = delete;
    Decoder& operator=(const Decoder&) = delete;
    ~Decoder() {
        if (tiff_) TIFFClose(tiff_);
    }

    /// Calls put(y, row) for each row of a page.
    template <class Put>
    void rows(const TiffPage& page, bool shades, Put put) {
        if (!TIFFSetSubDirectory(tiff_, page.at)) fail();
        // libtiff turns the colours of JPEG back into red, green and blue.
        if (page.photometric == kYcbcr && page.compression == kJpeg)
            TIFFSetField(tiff_, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
        page_ = &page;
        shades_ = shades;
        size_ = bytes_of(*type_of(page));
        const bool apart = page.planar == 2 && page.samples > 1;
        planes_ = apart ? page.samples : 1;
        together_ = apart ? 1 : page.samples;
        pixel_ = size_ * static_cast<std::size_t>(page.samples);
        const auto row = static_cast<std::size_t>(page.width) * pixel_;
        const std::int64_t band = band_height();
        check_density(client_.file.path(),
                      product(client_.file.path(), static_cast<std::int64_t>(row), band),
                      page.stored, kTiffDensest);
        band_.resize(row * static_cast<std::size_t>(band));
        for (std::int64_t top = 0; top < page.height; top += band) {
            const std::int64_t height = std::min(band, page.height - top);
            for (int plane = 0; plane < planes_; ++plane)
                if (TIFFIsTiled(tiff_))
                    tiles(top, height, plane);
                else
                    scanlines(top, height, plane);
            for (std::int64_t y = 0; y < height; ++y)
                put(top + y, band_.data() + static_cast<std::size_t>(y) * row);
        }
    }

 private:
    /// As many rows as are decoded at once: a row of tiles, or a strip where planes lie apart.
    std::int64_t band_height() {
        std::uint32_t rows = 1;
        if (TIFFIsTiled(tiff_))
            TIFFGetField(tiff_, TIFFTAG_TILELENGTH, &rows);
        else if (planes_ > 1)
            TIFFGetFieldDefaulted(tiff_, TIFFTAG_ROWSPERSTRIP, &rows);
        if (rows == 0) fail();
        return std::min<std::int64_t>(rows, page_->height);
    }
    std::size_t packed(std::int64_t pixels) const {
        return static_cast<std::size_t>((pixels * together_ * page_->bits + 7) / 8);
    }
    /// Pixels of one row of a strip or tile to their places in the band.
    void place(const std::byte* from, std::int64_t y, std::int64_t left, std::int64_t pixels,
               int plane) {
        const auto row = static_cast<std::size_t>(page_->width) * pixel_;
        std::byte* to = band_.data() + static_cast<std::size_t>(y) * row +
                        static_cast<std::size_t>(left) * pixel_ +
                        static_cast<std::size_t>(plane) * size_;
        const std::int64_t numbers = pixels * together_;
        const bool whole = static_cast<std::size_t>(page_->bits) == 8 * size_;
        if (planes_ == 1 && whole)
            std::memcpy(to, from, static_cast<std::size_t>(numbers) * size_);
        else if (planes_ == 1)
            unpack(from, numbers, page_->bits, shades_, to);
        if (planes_ == 1) return;
        if (!whole) {
            numbers_.resize(static_cast<std::size_t>(numbers) * size_);
            unpack(from, numbers, page_->bits, shades_, numbers_.data());
            from = numbers_.data();
        }
        for (std::int64_t i = 0; i < numbers; ++i)
            std::memcpy(to + static_cast<std::size_t>(i) * pixel_,
                        from + static_cast<std::size_t>(i) * size_, size_);
    }
    void scanlines(std::int64_t top, std::int64_t height, int plane) {
        raw_.resize(packed(page_->width));
        if (static_cast<std::size_t>(TIFFScanlineSize64(tiff_)) != raw_.size()) fail();
        for (std::int64_t y = 0; y < height; ++y) {
            if (TIFFReadScanline(tiff_, raw_.data(), static_cast<std::uint32_t>(top + y),
                                 static_cast<std::uint16_t>(plane)) != 1)
                fail();
            place(raw_.data(), y, 0, page_->width, plane);
        }
    }
    void tiles(std::int64_t top, std::int64_t height, int plane) {
        std::uint32_t width = 0, length = 0;
        TIFFGetField(tiff_, TIFFTAG_TILEWIDTH, &width);
        TIFFGetField(tiff_, TIFFTAG_TILELENGTH, &length);
        if (width == 0 || length == 0) fail();
        const auto bytes = static_cast<std::uint64_t>(packed(width)) * length;
        if (TIFFTileSize64(tiff_) != bytes ||
            bytes > static_cast<std::uint64_t>(kLargestAllocation))
            fail();
        check_density(client_.file.path(), static_cast<std::int64_t>(bytes), page_->stored,
                      kTiffDensest);
        raw_.resize(static_cast<std::size_t>(bytes));
        // A tile may reach beyond the picture.
        for (std::int64_t left = 0; left < page_->width; left += width) {
            const auto index = TIFFComputeTile(tiff_, static_cast<std::uint32_t>(left),
                                               static_cast<std::uint32_t>(top), 0,
                                               static_cast<std::uint16_t>(plane));
            if (TIFFReadEncodedTile(tiff_, index, raw_.data(), static_cast<tmsize_t>(bytes)) !=
                static_cast<tmsize_t>(bytes))
                fail();
            const std::int64_t used = std::min<std::int64_t>(width, page_->width - left);
            for (std::int64_t y = 0; y < height; ++y)
                place(raw_.data() + static_cast<std::size_t>(y) * packed(width), y, left, used,
                      plane);
        }
    }
    [[noreturn]] void fail() const {
        refuse(client_.file.path(),
               "damaged TIFF: " + (client_.error.empty() ? "its sizes contradict each other"
                                                         : shown(client_.error)));
    }

    Client client_;
    TIFF* tiff_ = nullptr;
    const TiffPage* page_ = nullptr;
    bool shades_ = true;
    std::size_t size_ = 1, pixel_ = 1;  // bytes of a number and of a pixel, decoded
    int planes_ = 1, together_ = 1;     // samples that lie apart, and those of one plane
    Bytes raw_, numbers_, band_;
};

/// What becomes of the numbers of a palette.
enum class Colours { none, grey, rgb };

/// Old programs wrote colours of 8 bits into numbers of 16.
std::uint8_t shade_of(const TiffPage& page, std::size_t at) {
    const bool small = std::all_of(page.colours.begin(), page.colours.end(),
                                   [](std::uint16_t value) { return value < 256; });
    return static_cast<std::uint8_t>(small ? page.colours[at] : page.colours[at] >> 8);
}

Colours colours_of(const TiffPage& page, bool indices) {
    if (page.photometric != kPalette || indices) return Colours::none;
    const std::size_t count = page.colours.size() / 3;
    for (std::size_t i = 0; i < count; ++i)
        if (page.colours[i] != page.colours[count + i] ||
            page.colours[i] != page.colours[2 * count + i])
            return Colours::rgb;
    return Colours::grey;
}

/// Red, green and blue (or one shade) of each index.
Bytes table_of(const TiffPage& page, Colours colours) {
    const std::size_t count = page.colours.size() / 3, channels = colours == Colours::rgb ? 3 : 1;
    Bytes table(count * channels);
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t c = 0; c < channels; ++c)
            table[i * channels + c] = static_cast<std::byte>(shade_of(page, c * count + i));
    return table;
}

class TiffReader : public Reader {
 public:
    TiffReader(std::vector<TiffPage> pages, TiffLayout layout, Colours colours)
        : pages_(std::move(pages)), layout_(std::move(layout)), colours_(colours) {}

    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<Message>& warnings) const override {
        const File file(header.file);
        Decoder decoder(file);
        Selection whole;  // of one page
        whole.as_stored = pick.as_stored;
        whole.bits64 = pick.bits64;
        const std::int64_t of_page = header.channels / layout_.channels,
                           time = pick.time.value_or(0);
        const std::size_t plane = into.size() / static_cast<std::size_t>(layout_.slices);
        for (std::int64_t z = 0; z < layout_.slices; ++z) {
            const auto here = into.subspan(static_cast<std::size_t>(z) * plane, plane);
            if (pick.channel) {
                Selection sample = whole;
                sample.channel = static_cast<int>(*pick.channel % of_page);
                page(decoder, header, layout_.page(*pick.channel / of_page, z, time), sample, here,
                     warnings);
            } else if (layout_.channels == 1) {
                page(decoder, header, layout_.page(0, z, time), whole, here, warnings);
            } else {
                together(decoder, header, z, time, whole, here, warnings);
            }
        }
    }

    std::optional<std::vector<std::string>> files() const override {
        return std::vector<std::string>{};
    }

 private:
    void page(Decoder& decoder, const Header& header, std::size_t index, const Selection& pick,
              std::span<std::byte> into, std::vector<Message>& warnings) const {
        const TiffPage& page = pages_[index];
        const int channels = colours_ == Colours::rgb ? 3 : page.samples;
        Rows rows(page.width, page.height, channels, header.type, page.orientation, pick, into);
        if (const Wide wide = wide_of(page); wide != Wide::no) {
            const std::size_t count = static_cast<std::size_t>(page.width * page.samples);
            Bytes doubles(count * sizeof(double));
            std::int64_t rounded = 0;
            decoder.rows(page, false, [&](std::int64_t y, const std::byte* row) {
                rounded += wide_numbers(row, count, as_read(wide, pick), doubles.data());
                rows.put(y, doubles.data());
            });
            tell_wide(header, rounded, warnings);
        } else if (colours_ == Colours::none) {
            decoder.rows(page, page.photometric != kPalette,
                         [&](std::int64_t y, const std::byte* row) { rows.put(y, row); });
        } else {
            const Bytes table = table_of(page, colours_);
            const auto width = static_cast<std::size_t>(channels);
            Bytes coloured(static_cast<std::size_t>(page.width) * width);
            decoder.rows(page, false, [&](std::int64_t y, const std::byte* row) {
                for (std::size_t x = 0; x < coloured.size() / width; ++x)
                    std::memcpy(coloured.data() + x * width,
                                table.data() + std::to_integer<std::size_t>(row[x]) * width, width);
                rows.put(y, coloured.data());
            });
        }
        rows.tell(header.file, warnings);
    }
    /// Channels of different pages into one plane of samples.
    void together(Decoder& decoder, const Header& header, std::int64_t z, std::int64_t time,
                  const Selection& whole, std::span<std::byte> into,
                  std::vector<Message>& warnings) const {
        const auto channels = static_cast<std::size_t>(layout_.channels);
        const std::size_t width = bytes_of(loaded_type(header.type, whole.as_stored)) *
                                  static_cast<std::size_t>(header.channels) / channels;
        Bytes one(into.size() / channels);
        for (std::size_t c = 0; c < channels; ++c) {
            page(decoder, header, layout_.page(static_cast<std::int64_t>(c), z, time), whole, one,
                 warnings);
            for (std::size_t i = 0; i < one.size() / width; ++i)
                std::memcpy(into.data() + (i * channels + c) * width, one.data() + i * width,
                            width);
        }
    }

    std::vector<TiffPage> pages_;
    TiffLayout layout_;
    Colours colours_;
};

/// Fields of one directory, written in the order of their tags.
class Fields {
 public:
    explicit Fields(bool wide) : wide_(wide) {}
    void add(unsigned tag, unsigned type, std::vector<std::uint64_t> values) {
        fields_.push_back({tag, type, std::move(values)});
    }
    std::size_t count() const { return fields_.size(); }
    std::size_t bytes() const {
        std::size_t total = wide_ ? 16 + 20 * fields_.size() : 6 + 12 * fields_.size();
        for (const Field& field : fields_)
            if (size(field) > inside()) total += (size(field) + 7) / 8 * 8;
        return (total + 7) / 8 * 8;
    }
    /// The directory for a place in the file, values behind it.
    std::string text(std::uint64_t at, std::uint64_t next) const {
        std::string directory, behind;
        put(directory, fields_.size(), wide_ ? 8 : 2);
        const std::uint64_t start =
            at + (wide_ ? 16 + 20 * fields_.size() : 6 + 12 * fields_.size());
        for (const Field& field : fields_) {
            put(directory, field.tag, 2);
            put(directory, field.type, 2);
            // A fraction is two numbers.
            put(directory, field.values.size() / (field.type == 5 ? 2 : 1), wide_ ? 8 : 4);
            std::string values;
            for (std::uint64_t value : field.values) put(values, value, width(field));
            if (values.size() > inside()) {
                put(directory, start + behind.size(), inside());
                values.resize((values.size() + 7) / 8 * 8);
                behind += values;
            } else {
                values.resize(inside());
                directory += values;
            }
        }
        put(directory, next, inside());
        directory += behind;
        directory.resize(bytes());
        return directory;
    }
    static void put(std::string& to, std::uint64_t value, std::size_t width) {
        // In the machine's byte order, as the samples.
        char raw[8];
        for (std::size_t i = 0; i < width; ++i)
            raw[std::endian::native == std::endian::little ? i : width - 1 - i] =
                static_cast<char>(value >> 8 * i);
        to.append(raw, width);
    }

 private:
    struct Field {
        unsigned tag, type;
        std::vector<std::uint64_t> values;
    };
    static std::size_t width(const Field& field) {
        return field.type == 16                     ? 8
               : field.type == 4 || field.type == 5 ? 4
               : field.type == 3                    ? 2
                                                    : 1;
    }
    static std::size_t size(const Field& field) { return width(field) * field.values.size(); }
    std::size_t inside() const { return wide_ ? 8 : 4; }
    bool wide_;
    std::vector<Field> fields_;
};

/// The fraction of 32-bit numbers next to a positive value, by its continued fraction.
std::vector<std::uint64_t> fraction_of(double value) {
    constexpr double kMost = 4294967295.0;
    double above[2] = {0, 1}, below[2] = {1, 0}, rest = value;
    for (int i = 0; i < 40; ++i) {
        const double whole = std::floor(rest);
        const double next_above = whole * above[1] + above[0];
        const double next_below = whole * below[1] + below[0];
        if (!(next_above <= kMost && next_below <= kMost)) break;
        above[0] = std::exchange(above[1], next_above);
        below[0] = std::exchange(below[1], next_below);
        if (rest == whole) break;
        rest = 1 / (rest - whole);
    }
    return {static_cast<std::uint64_t>(above[1]), static_cast<std::uint64_t>(below[1])};
}

/// Lengths as ImageJ says them, which readers of microscopy and the one above know: in micrometres.
struct Lengths {
    std::string text;  // of the first page
    std::vector<std::uint64_t> resolution[2];
};
std::optional<Lengths> lengths_of(const Header& what) {
    // ImageJ's axes never turn, so of a grid that is turned it can say no origin.
    const bool placed = is_identity(what.direction) && what.origin != Vector{0, 0, 0};
    if (what.unit.empty() && what.spacing == Vector{1, 1, 1} && !placed) return std::nullopt;
    const double factor = what.unit.empty() ? 1 : 1e3;
    Lengths lengths;
    for (std::size_t axis = 0; axis < 2; ++axis) {
        lengths.resolution[axis] = fraction_of(1 / (what.spacing[axis] * factor));
        const auto& pair = lengths.resolution[axis];
        if (pair[0] == 0 || pair[1] == 0) return std::nullopt;  // beyond what fractions hold
    }
    lengths.text =
        fmt::format("ImageJ=1.53t\nimages={0}\nslices={0}\nunit={1}\nspacing={2}\n", what.extent.z,
                    what.unit.empty() ? "pixel" : "micron", what.spacing[2] * factor);
    constexpr const char* kOrigins[] = {"xorigin", "yorigin", "zorigin"};
    for (std::size_t axis = 0; axis < 3 && placed; ++axis)
        if (what.origin[axis] != 0)
            lengths.text +=
                fmt::format("{}={}\n", kOrigins[axis], -what.origin[axis] / what.spacing[axis]);
    return lengths;
}

Fields fields_of(const Header& what, const std::optional<Lengths>& lengths, bool first, bool wide,
                 std::uint64_t strip, std::uint64_t strip_bytes) {
    const auto channels = static_cast<std::size_t>(what.channels);
    const std::uint64_t format = is_integer(what.type) ? (limits_of(what.type)[0] < 0 ? 2 : 1) : 3;
    const unsigned place = wide ? 16 : 4;
    Fields fields(wide);
    fields.add(256, 4, {static_cast<std::uint64_t>(what.extent.x)});
    fields.add(257, 4, {static_cast<std::uint64_t>(what.extent.y)});
    fields.add(258, 3, std::vector<std::uint64_t>(channels, 8 * bytes_of(what.type)));
    fields.add(259, 3, {1});
    const bool colour = is_colour(what);
    fields.add(262, 3, {colour ? 2u : 1u});
    if (lengths && first) {
        std::vector<std::uint64_t> text(lengths->text.begin(), lengths->text.end());
        text.push_back(0);
        fields.add(270, 2, std::move(text));
    }
    fields.add(273, place, {strip});
    fields.add(277, 3, {channels});
    fields.add(278, 4, {static_cast<std::uint64_t>(what.extent.y)});
    fields.add(279, place, {strip_bytes});
    if (lengths) {
        fields.add(282, 5, lengths->resolution[0]);
        fields.add(283, 5, lengths->resolution[1]);
    }
    fields.add(284, 3, {1});
    if (lengths) fields.add(296, 3, {1});
    // Samples beyond grey, or red, green and blue: only the last may be alpha.
    std::vector<std::uint64_t> more(channels - (colour ? 3 : 1));
    if (!more.empty() && (colour || channels == 2))
        more.back() = what.alpha == Alpha::premultiplied ? 1
                      : what.alpha == Alpha::straight    ? 2
                                                         : 0;
    if (!more.empty()) fields.add(338, 3, std::move(more));
    fields.add(339, 3, std::vector<std::uint64_t>(channels, format));
    if (!what.icc.empty()) {
        std::vector<std::uint64_t> profile;
        for (std::byte byte : what.icc) profile.push_back(std::to_integer<std::uint64_t>(byte));
        fields.add(34675, 7, std::move(profile));
    }
    return fields;
}

/// ImageJ writes stacks of more than 4 GB with one directory: all samples follow its own.
void take_one_directory(Header& header, const TiffPage& page, const TiffLayout& layout) {
    if (page.compression != 1 || !page.in_one_piece || page.orientation != 1 ||
        (page.planar == 2 && page.samples > 1) ||
        static_cast<std::size_t>(page.bits) != 8 * bytes_of(header.type))
        refuse(header.file,
               fmt::format("its description says {} images, but it has one page, whose "
                           "samples are not plain",
                           layout.pages.size()));
    Stored stored;
    stored.type = header.type;
    stored.wide = wide_of(page);
    stored.big_endian = page.big_endian;
    stored.pieces = {{header.file, page.first}};
    stored.axes = {{Axis::channel, page.samples}, {Axis::x, page.width},
                   {Axis::y, page.height},        {Axis::channel, layout.channels},
                   {Axis::z, layout.slices},      {Axis::time, layout.times}};
    take_axes(header, stored);
    take_reader(header, std::move(stored));
}

}  // namespace

Header inspect_tiff(const std::string& path, const Selection& pick) {
    const auto file = std::make_shared<const File>(path);
    std::vector<TiffPage> pages = tiff_pages(*file);
    Header header;
    header.file = path;
    header.format = "TIFF";
    TiffLayout layout = tiff_layout(header, file, pages, pick);
    if (layout.pages.empty()) refuse(path, "holds thumbnails only");
    const TiffPage first = pages[layout.pages[0]];
    const Colours colours = colours_of(first, layout.indices);
    for (const std::size_t index : layout.pages) {
        const TiffPage& page = pages[index];
        if (page.format > 4) refuse(path, "complex samples are not supported");
        if (!is_plain(page) && pages.size() == 1) return inspect_by_oiio(path, "tiff");
        if (!is_plain(page))
            refuse(path,
                   fmt::format("pages of {} bits, photometric {}, compression {}: not supported",
                               page.bits, page.photometric, page.compression));
        if (page.width != first.width || page.height != first.height ||
            page.samples != first.samples || page.bits != first.bits ||
            wide_of(page) != wide_of(first) || type_of(page) != type_of(first) ||
            page.orientation != first.orientation || colours_of(page, layout.indices) != colours)
            refuse(path, fmt::format("pages differ: {} x {} and {} x {}, or in their type",
                                     first.width, first.height, page.width, page.height));
    }
    header.type = *type_of(first);
    const std::int64_t channels =
        layout.channels * (colours == Colours::rgb ? 3 : std::int64_t{first.samples});
    if (channels > (1 << 20) || layout.times > (1 << 20))
        refuse(path,
               fmt::format("{} channels and {} times are not supported", channels, layout.times));
    header.channels = static_cast<int>(channels);
    header.times = static_cast<int>(layout.times);
    if (channels == first.samples && first.samples % 2 == 0 && first.samples <= 4 && first.alpha)
        header.alpha = first.premultiplied ? Alpha::premultiplied : Alpha::straight;
    constexpr int kRgb = 2;
    header.colour =
        layout.channels == 1 && (channels == 3 || channels == 4) &&
        (first.photometric == kRgb || first.photometric == kYcbcr || colours == Colours::rgb);
    take_size(header, first.width, first.height, first.orientation);
    if (first.orientation >= 5) std::swap(header.spacing[0], header.spacing[1]);
    header.extent.z = layout.slices;
    product(path, product(path, product(path, header.extent.x, header.extent.y), channels * 8),
            header.extent.z);
    check_spacing(header, "XResolution");
    if (layout.channels > 1 && !layout.one_directory)
        header.reading_bytes += static_cast<std::size_t>(header.extent.x * header.extent.y * 8);
    if (first.photometric == 0)
        header.warnings.push_back(path +
                                  ": small values are bright (min is white); kept as stored");
    if (layout.indices && first.photometric == kPalette)
        header.warnings.push_back(path +
                                  ": its colour table only shows the values, which are kept");
    if (first.icc_bytes > 0 && first.icc_bytes < (16 << 20)) {
        header.icc.resize(first.icc_bytes);
        file->read(first.icc, header.icc, "the ICC profile");
    }
    header.integers = wide_of(first);
    if (layout.one_directory)
        take_one_directory(header, first, layout);
    else
        header.reader = std::make_shared<const TiffReader>(std::move(pages), layout, colours);
    header.volume = layout.volume;
    return header;
}

void write_tiff(Replacement& out, const Header& what, const void* samples) {
    const std::span<const std::byte> all = samples_of(what, samples);
    const auto pages = static_cast<std::uint64_t>(what.extent.z);
    const std::uint64_t strip = all.size() / pages, padded = (strip + 7) / 8 * 8;
    // Offsets of TIFF have 32 bits; what needs more is BigTIFF.
    const bool wide = all.size() + pages * 4096 + what.icc.size() * pages > 0xffffffffu;
    const char order = std::endian::native == std::endian::little ? 'I' : 'M';
    std::string head{order, order};
    Fields::put(head, wide ? 43 : 42, 2);
    if (wide) {
        Fields::put(head, 8, 2);
        Fields::put(head, 0, 2);
    }
    std::uint64_t at = wide ? 16 : 8;
    Fields::put(head, at, wide ? 8 : 4);
    out.write(std::as_bytes(std::span(head)));
    const auto lengths = lengths_of(what);
    // Directory, then its samples, page after page: written in one go, never revised.
    for (std::uint64_t page = 0; page < pages; ++page) {
        const auto fields = [&](std::uint64_t strip_at) {
            return fields_of(what, lengths, page == 0, wide, strip_at, strip);
        };
        const std::uint64_t samples_at = at + fields(0).bytes(), next = samples_at + padded;
        const std::string text = fields(samples_at).text(at, page + 1 < pages ? next : 0);
        out.write(std::as_bytes(std::span(text)));
        out.write(all.subspan(page * strip, strip));
        const std::byte zeros[8] = {};
        out.write(std::span(zeros).first(padded - strip));
        at = next;
    }
}

}  // namespace edgewise::store
