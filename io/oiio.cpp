// Pictures that OpenImageIO reads and writes: which files are theirs, what their headers claim
// before that library believes it, and what its formats make of channels and alpha.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fmt/format.h>

#include "io/module.hpp"
#include "io/reader.hpp"
#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr std::size_t kLongestHeader = 16 << 20;  // of EXR
constexpr std::size_t kPeek = 1 << 16;            // where other formats say their size

struct Mark {
    std::size_t at;
    std::string_view bytes;
    const char* library;
};
constexpr Mark kMarks[] = {
    {0, "\x76\x2f\x31\x01", "openexr"},
    {8, "WEBP", "webp"},
    {0, std::string_view("\0\0\0\x0cjP  ", 8), "jpeg2000"},
    {0, "\xff\x4f\xff\x51", "jpeg2000"},
    {0, "GIF8", "gif"},
    {0, "8BPS", "psd"},
    {4, "ftyp", "heif"},
    {0, "SDPX", "dpx"},
    {0, "XPDS", "dpx"},
    {0, "\x80\x2a\x5f\xd7", "cineon"},
    {0, "DDS ", "dds"},
    {0, "FOR4", "iff"},
    {0, "#?", "hdr"},
    {0, "BM", "bmp"},
    {0, "\x01\xda", "sgi"},
};

std::string_view text_of(std::span<const std::byte> bytes) noexcept {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Numbers of a header, 0 beyond its end.
std::int64_t number(std::string_view bytes, std::size_t at, int width, bool big) noexcept {
    std::int64_t value = 0;
    for (int i = 0; i < width; ++i) {
        const std::size_t place = at + static_cast<std::size_t>(big ? i : width - 1 - i);
        value = value << 8 | (place < bytes.size() ? static_cast<unsigned char>(bytes[place]) : 0);
    }
    return value;
}

class Claims {
 public:
    Claims(const std::string& path, std::uint64_t size) : path_(path), size_(size) {}
    /// @param bytes  of one pixel in memory
    void check(std::int64_t width, std::int64_t height, std::int64_t bytes) {
        if (width < 1 || height < 1)
            refuse(path_, fmt::format("is {} x {} pixels, expected 1 or more", width, height));
        const std::int64_t all = product(path_, product(path_, width, height), bytes);
        check_density(path_, all, size_, kDensest);
        largest_ = std::max(largest_, all);
    }
    void rows(std::int64_t width, std::int64_t height, std::int64_t most) const {
        if (height > most)
            refuse(path_,
                   fmt::format("{} x {} pixels do not fit into {} bytes", width, height, size_));
    }
    std::uint64_t size() const { return size_; }
    const std::string& path() const { return path_; }
    std::int64_t largest() const { return largest_; }

 private:
    const std::string& path_;
    std::uint64_t size_;
    std::int64_t largest_ = 0;  // that was claimed [bytes]
};

/// Attributes of one part's header, from `at`. @return where it ends; 0: there is none
std::size_t check_exr_part(Claims& claims, std::string_view head, std::size_t at) {
    const auto name = [&] {
        const std::size_t end = head.substr(0, std::min(head.size(), at + 256)).find('\0', at);
        if (end == head.npos)
            refuse(claims.path(), "damaged EXR header: it ends too early, or a name is too long");
        const std::string_view found = head.substr(at, end - at);
        at = end + 1;
        return found;
    };
    std::int64_t channels = 0;
    std::array<std::int64_t, 4> window{0, 0, -1, -1};
    std::string_view attribute = name();
    if (attribute.empty()) return 0;
    for (; !attribute.empty(); attribute = name()) {
        name();  // its type
        const auto bytes = static_cast<std::size_t>(number(head, at, 4, false));
        at += 4;
        if (at > head.size() || bytes > head.size() - at)
            refuse(claims.path(), "damaged EXR header: it ends too early");
        if (attribute == "dataWindow")
            for (std::size_t i = 0; i < 4; ++i)
                window[i] = static_cast<std::int32_t>(number(head, at + 4 * i, 4, false));
        // A channel is a name, its end, and 16 bytes.
        if (attribute == "channels") channels = static_cast<std::int64_t>(bytes / 18);
        at += bytes;
    }
    const std::int64_t width = window[2] - window[0] + 1, height = window[3] - window[1] + 1;
    claims.check(width, height, 2 * std::max<std::int64_t>(channels, 1));
    // A block of at most 256 rows takes 8 bytes of the table of offsets, and at least as much
    // itself.
    claims.rows(width, height, 32 * static_cast<std::int64_t>(claims.size()));
    return at;
}

/// OpenEXR makes a table of as many rows as the header claims.
void check_exr(Claims& claims, std::string_view head) {
    constexpr std::int64_t kManyParts = 0x1000;
    const bool many = (number(head, 4, 4, false) & kManyParts) != 0;
    std::size_t at = 8;
    do at = check_exr_part(claims, head, at);
    while (many && at > 0);
}

/// Canvas of an extended file, or the size of its only picture.
void check_webp(Claims& claims, std::string_view head) {
    const std::string_view kind = head.size() < 30 ? "" : head.substr(12, 4);
    if (kind == "VP8X")
        claims.check(number(head, 24, 3, false) + 1, number(head, 27, 3, false) + 1, 4);
    else if (kind == "VP8L")
        claims.check((number(head, 21, 4, false) & 0x3fff) + 1,
                     (number(head, 21, 4, false) >> 14 & 0x3fff) + 1, 4);
    else if (kind == "VP8 ")
        claims.check(number(head, 26, 2, false) & 0x3fff, number(head, 28, 2, false) & 0x3fff, 4);
    else
        refuse(claims.path(), "damaged WebP header");
}

/// The SIZ marker of the codestream (ITU-T T.800, A.5.1).
void check_jpeg2000(Claims& claims, std::string_view head) {
    const std::size_t at = head.find("\xff\x4f\xff\x51");
    if (at == head.npos || at + 42 > head.size())
        refuse(claims.path(), "damaged JPEG 2000 header: it has no size");
    const auto side = [&](std::size_t end) {
        return number(head, at + end, 4, true) - number(head, at + end + 8, 4, true);
    };
    claims.check(side(8), side(12), 4 * number(head, at + 40, 2, true));
}

/// Pictures of several sizes in one file: each says its own (ISO/IEC 23008-12, 6.5.3).
void check_heif(Claims& claims, std::string_view head) {
    for (std::size_t at = head.find("ispe"); at != head.npos; at = head.find("ispe", at + 4))
        claims.check(number(head, at + 8, 4, true), number(head, at + 12, 4, true), 4);
}

/// What a header claims, before its library, which believes it, opens the file.
/// @return the bytes of samples that it claims, 0 where that is not looked at
std::int64_t check_claims(const std::string& path, const std::string& library) {
    const File file(path);
    Claims claims(path, file.size());
    const Bytes bytes = file.head(library == "openexr" ? kLongestHeader : kPeek);
    const std::string_view head = text_of(bytes);
    const std::string_view found = library_format(bytes);
    if (library == "openexr" && found != library) refuse(path, "not EXR: wrong signature");
    if (library == "openexr") check_exr(claims, head);
    if (library == "webp") check_webp(claims, head);
    if (library == "jpeg2000") check_jpeg2000(claims, head);
    if (library == "heif") check_heif(claims, head);
    if (library == "gif") claims.check(number(head, 6, 2, false), number(head, 8, 2, false), 4);
    if (library == "psd")
        claims.check(
            number(head, 18, 4, true), number(head, 14, 4, true),
            number(head, 12, 2, true) * std::max<std::int64_t>(number(head, 22, 2, true) / 8, 1));
    return claims.largest();
}

// Writing
// ------------------------------------------------------------------------------------------

float value_at(Type type, const std::byte* from) noexcept {
    const auto as = [&](auto value) {
        std::memcpy(&value, from, sizeof value);
        return value;
    };
    switch (type) {
        case Type::u8:
            return as(std::uint8_t{});
        case Type::u16:
            return as(std::uint16_t{});
        case Type::f16:
            return half_to_float(as(std::uint16_t{}));
        default:
            return as(float{});
    }
}

void put_value(Type type, float value, std::byte* to) noexcept {
    const auto put = [&](auto number) { std::memcpy(to, &number, sizeof number); };
    const auto whole = [&](float most) {
        return std::isnan(value) ? 0.0f : std::clamp(std::nearbyint(value), 0.0f, most);
    };
    switch (type) {
        case Type::u8:
            return put(static_cast<std::uint8_t>(whole(255)));
        case Type::u16:
            return put(static_cast<std::uint16_t>(whole(65535)));
        case Type::f16:
            return put(float_to_half(value));
        default:
            return put(value);
    }
}

/// Colour times alpha, or divided by it: 0 where that is 0.
void change_alpha(const Header& what, bool multiply, Bytes& samples) {
    const std::size_t width = bytes_of(what.type);
    const auto channels = static_cast<std::size_t>(what.channels);
    const float opaque = is_integer(what.type) ? static_cast<float>(limits_of(what.type)[1]) : 1;
    for (std::byte* pixel = samples.data(); pixel != samples.data() + samples.size();
         pixel += channels * width) {
        const float alpha = value_at(what.type, pixel + (channels - 1) * width) / opaque;
        const float factor = multiply ? alpha : alpha == 0 ? 0 : 1 / alpha;
        for (std::size_t c = 0; c + 1 < channels; ++c)
            put_value(what.type, value_at(what.type, pixel + c * width) * factor,
                      pixel + c * width);
    }
}

Bytes grey_as_colour(std::span<const std::byte> grey, std::size_t width) {
    Bytes colour(grey.size() * 3);
    for (std::size_t i = 0; i < grey.size(); i += width)
        for (std::size_t c = 0; c < 3; ++c)
            std::memcpy(colour.data() + 3 * i + c * width, grey.data() + i, width);
    return colour;
}

/// RGBE has no sign, no infinity and no NaN.
void clip_to_rgbe(Bytes& samples) {
    constexpr float kMost = 0x1.fep127f;
    for (std::size_t i = 0; i < samples.size(); i += sizeof(float)) {
        const float value = value_at(Type::f32, samples.data() + i);
        put_value(Type::f32, value > 0 ? std::min(value, kMost) : 0, samples.data() + i);
    }
}

}  // namespace

std::string_view library_format(std::span<const std::byte> head) noexcept {
    const std::string_view text = text_of(head);
    for (const Mark& mark : kMarks)
        if (text.size() > mark.at && text.substr(mark.at).starts_with(mark.bytes))
            return mark.library;
    // P1 to P6, PF, Pf and a blank.
    if (text.size() > 2 && text[0] == 'P' &&
        std::string_view("123456Ff").find(text[1]) != text.npos &&
        std::string_view(" \t\r\n#").find(text[2]) != text.npos)
        return "pnm";
    return "";
}

Header inspect_by_oiio(const std::string& path, const std::string& library) {
    const std::int64_t claimed = check_claims(path, library);
    Header header = inspect_by(Library::oiio, path, library.c_str(), claimed);
    for (const Format& format : formats())
        if (format.library == library && (library != "pnm" || ends_with_any(path, format.endings)))
            header.format = format.name;
    return header;
}

Bytes with_alpha_of(const Format& format, const Header& what, const void* samples) {
    if (what.channels % 2 != 0 || what.alpha == Alpha::none || what.alpha == format.alpha)
        return {};
    const std::span<const std::byte> from = samples_of(what, samples);
    Bytes changed(from.begin(), from.end());
    change_alpha(what, format.alpha == Alpha::premultiplied, changed);
    return changed;
}

void write_by_oiio(Replacement& out, const Format& format, const Header& what, const void* samples,
                   int quality) {
    std::span<const std::byte> from = samples_of(what, samples);
    const bool has_alpha = what.channels % 2 == 0;
    ModuleImage image;
    image.size[0] = what.extent.x;
    image.size[1] = what.extent.y;
    image.channels = what.channels;
    image.type = static_cast<int>(what.type);
    image.alpha = static_cast<int>(has_alpha ? format.alpha : Alpha::none);
    const bool stream = ends_with_any(out.path(), {".j2k", ".j2c"});
    std::snprintf(image.format, sizeof image.format, "%s", stream ? "j2k" : format.library.c_str());
    Bytes changed;
    const bool colour_only = format.library == "webp" || format.library == "hdr";
    if (what.channels == 1 && colour_only) {
        changed = grey_as_colour(from, bytes_of(what.type));
        image.channels = 3;
    }
    if (format.library == "hdr") {
        if (changed.empty()) changed.assign(from.begin(), from.end());
        clip_to_rgbe(changed);
    }
    if (!changed.empty()) from = changed;
    module_write(Library::oiio, out, image, from, quality);
}

}  // namespace edgewise::store
