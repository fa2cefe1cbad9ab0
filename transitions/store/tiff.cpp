// TIFF and BigTIFF: several pages are a volume. Reading decodes by libtiff what tiff_directory.cpp
// has checked; what is neither grey nor RGB goes to OpenImageIO. Writing is uncompressed.

#include <bit>
#include <cstring>
#include <fmt/format.h>
#include <tiffio.h>

#include "transitions/store/picture.hpp"
#include "transitions/store/text.hpp"
#include "transitions/store/tiff_directory.hpp"

namespace edgewise::store {
namespace {

constexpr int kCompressions[] = {1, 5, 8, 32946, 32773, 34925, 50000};  // that give plain samples
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

    void open(const TiffPage& page) {
        if (!TIFFSetSubDirectory(tiff_, page.at)) fail();
        row_.resize(static_cast<std::size_t>(page.width * page.samples * page.bits / 8));
        if (TIFFIsTiled(tiff_)) return;
        if (static_cast<std::size_t>(TIFFScanlineSize64(tiff_)) != row_.size()) fail();
    }
    void rows(const TiffPage& page, Rows& to) {
        if (TIFFIsTiled(tiff_)) return tiles(page, to);
        for (std::int64_t y = 0; y < page.height; ++y) {
            if (TIFFReadScanline(tiff_, row_.data(), static_cast<std::uint32_t>(y), 0) != 1) fail();
            to.put(y, row_.data());
        }
    }

 private:
    void tiles(const TiffPage& page, Rows& to) {
        std::uint32_t width = 0, height = 0;
        TIFFGetField(tiff_, TIFFTAG_TILEWIDTH, &width);
        TIFFGetField(tiff_, TIFFTAG_TILELENGTH, &height);
        const std::size_t pixel = static_cast<std::size_t>(page.samples * page.bits / 8);
        const std::size_t bytes = std::size_t{width} * height * pixel;
        if (width == 0 || height == 0 || static_cast<std::size_t>(TIFFTileSize64(tiff_)) != bytes ||
            bytes > static_cast<std::size_t>(kLargestAllocation))
            fail();
        check_density(client_.file.path(), static_cast<std::int64_t>(bytes), page.stored,
                      kTiffDensest);
        // A tile may reach beyond the picture.
        const auto rows = static_cast<std::size_t>(std::min<std::int64_t>(height, page.height));
        Bytes tile(bytes), band(row_.size() * rows);
        for (std::int64_t top = 0; top < page.height; top += height) {
            for (std::int64_t left = 0; left < page.width; left += width) {
                const auto index = TIFFComputeTile(tiff_, static_cast<std::uint32_t>(left),
                                                   static_cast<std::uint32_t>(top), 0, 0);
                if (TIFFReadEncodedTile(tiff_, index, tile.data(), static_cast<tmsize_t>(bytes)) !=
                    static_cast<tmsize_t>(bytes))
                    fail();
                const auto used =
                    static_cast<std::size_t>(std::min<std::int64_t>(width, page.width - left)) *
                    pixel;
                for (std::size_t y = 0; y < rows; ++y)
                    std::memcpy(
                        band.data() + y * row_.size() + static_cast<std::size_t>(left) * pixel,
                        tile.data() + y * width * pixel, used);
            }
            for (std::int64_t y = 0; y < height && top + y < page.height; ++y)
                to.put(top + y, band.data() + static_cast<std::size_t>(y) * row_.size());
        }
    }
    [[noreturn]] void fail() const {
        refuse(client_.file.path(),
               "damaged TIFF: " + (client_.error.empty() ? "its sizes contradict each other"
                                                         : shown(client_.error)));
    }

    Client client_;
    TIFF* tiff_ = nullptr;
    Bytes row_;
};

class TiffReader : public Reader {
 public:
    explicit TiffReader(std::vector<TiffPage> pages) : pages_(std::move(pages)) {}
    void read(const Header& header, const Selection& pick, std::span<std::byte> into,
              std::vector<std::string>& warnings) const override {
        const File file(header.file);
        Decoder decoder(file);
        const std::size_t plane = into.size() / pages_.size();
        for (std::size_t i = 0; i < pages_.size(); ++i) {
            decoder.open(pages_[i]);
            Rows rows(pages_[i].width, pages_[i].height, pages_[i].samples, header.type,
                      pages_[i].orientation, pick, into.subspan(i * plane, plane));
            decoder.rows(pages_[i], rows);
            rows.tell(header.file, warnings);
        }
    }

    std::optional<std::vector<std::string>> files() const override {
        return std::vector<std::string>{};
    }

 private:
    std::vector<TiffPage> pages_;
};

std::optional<Type> type_of(const TiffPage& page) {
    struct Row {
        int bits, format;
        Type type;
    };
    constexpr Row kTypes[] = {{8, 1, Type::u8},   {8, 2, Type::i8},   {16, 1, Type::u16},
                              {16, 2, Type::i16}, {32, 1, Type::u32}, {32, 2, Type::i32},
                              {16, 3, Type::f16}, {32, 3, Type::f32}, {64, 3, Type::f64}};
    for (const Row& row : kTypes)
        if (row.bits == page.bits && row.format == (page.format == 4 ? 1 : page.format))
            return row.type;
    return std::nullopt;
}

bool is_plain(const TiffPage& page) {
    const bool decodes = std::find(std::begin(kCompressions), std::end(kCompressions),
                                   page.compression) != std::end(kCompressions);
    return decodes && !page.mixed && page.photometric <= 2 && page.samples <= 4 &&
           (page.planar == 1 || page.samples == 1) && type_of(page).has_value();
}

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
            put(directory, field.values.size(), wide_ ? 8 : 4);
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
        return field.type == 16 ? 8 : field.type == 4 ? 4 : field.type == 3 ? 2 : 1;
    }
    static std::size_t size(const Field& field) { return width(field) * field.values.size(); }
    std::size_t inside() const { return wide_ ? 8 : 4; }
    bool wide_;
    std::vector<Field> fields_;
};

Fields fields_of(const Header& what, bool wide, std::uint64_t strip, std::uint64_t strip_bytes) {
    const auto channels = static_cast<std::size_t>(what.channels);
    const std::uint64_t format = is_integer(what.type) ? (limits_of(what.type)[0] < 0 ? 2 : 1) : 3;
    const unsigned place = wide ? 16 : 4;
    Fields fields(wide);
    fields.add(256, 4, {static_cast<std::uint64_t>(what.extent.x)});
    fields.add(257, 4, {static_cast<std::uint64_t>(what.extent.y)});
    fields.add(258, 3, std::vector<std::uint64_t>(channels, 8 * bytes_of(what.type)));
    fields.add(259, 3, {1});
    fields.add(262, 3, {channels >= 3 ? 2u : 1u});
    fields.add(273, place, {strip});
    fields.add(277, 3, {channels});
    fields.add(278, 4, {static_cast<std::uint64_t>(what.extent.y)});
    fields.add(279, place, {strip_bytes});
    fields.add(284, 3, {1});
    if (channels % 2 == 0)
        fields.add(338, 3,
                   {what.alpha == Alpha::premultiplied ? 1u
                    : what.alpha == Alpha::straight    ? 2u
                                                       : 0u});
    fields.add(339, 3, std::vector<std::uint64_t>(channels, format));
    if (!what.icc.empty()) {
        std::vector<std::uint64_t> profile;
        for (std::byte byte : what.icc) profile.push_back(std::to_integer<std::uint64_t>(byte));
        fields.add(34675, 7, std::move(profile));
    }
    return fields;
}

}  // namespace

Header inspect_tiff(const std::string& path) {
    const File file(path);
    std::vector<TiffPage> pages = tiff_pages(file);
    if (pages.size() > 1) std::erase_if(pages, [](const TiffPage& page) { return page.reduced; });
    if (pages.empty()) refuse(path, "holds thumbnails only");
    const TiffPage& first = pages[0];
    for (const TiffPage& page : pages) {
        if (!is_plain(page) && pages.size() == 1) return inspect_by_oiio(path);
        if (!is_plain(page))
            refuse(path,
                   fmt::format("pages of {} bits, photometric {}, compression {}: not supported",
                               page.bits, page.photometric, page.compression));
        if (page.width != first.width || page.height != first.height ||
            page.samples != first.samples || type_of(page) != type_of(first) ||
            page.orientation != first.orientation)
            refuse(path, fmt::format("pages differ: {} x {} and {} x {}, or in their type",
                                     first.width, first.height, page.width, page.height));
    }
    Header header;
    header.file = path;
    header.format = "TIFF";
    header.type = *type_of(first);
    header.channels = first.samples;
    if (first.samples % 2 == 0 && first.alpha)
        header.alpha = first.premultiplied ? Alpha::premultiplied : Alpha::straight;
    take_size(header, first.width, first.height, first.orientation);
    header.extent.z = static_cast<std::int64_t>(pages.size());
    product(path, header.extent.x * header.extent.y * header.channels * 8, header.extent.z);
    header.volume = pages.size() > 1;
    if (first.photometric == 0)
        header.warnings.push_back(path +
                                  ": small values are bright (min is white); kept as stored");
    if (first.icc_bytes > 0 && first.icc_bytes < (16 << 20)) {
        header.icc.resize(first.icc_bytes);
        file.read(first.icc, header.icc, "the ICC profile");
    }
    header.reader = std::make_shared<const TiffReader>(std::move(pages));
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
    // Directory, then its samples, page after page: written in one go, never revised.
    for (std::uint64_t page = 0; page < pages; ++page) {
        const std::size_t directory = fields_of(what, wide, 0, strip).bytes();
        const std::uint64_t samples_at = at + directory, next = samples_at + padded;
        const std::string text =
            fields_of(what, wide, samples_at, strip).text(at, page + 1 < pages ? next : 0);
        out.write(std::as_bytes(std::span(text)));
        out.write(all.subspan(page * strip, strip));
        const std::byte zeros[8] = {};
        out.write(std::span(zeros).first(padded - strip));
        at = next;
    }
}

}  // namespace edgewise::store
