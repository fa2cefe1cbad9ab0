#include "io/picture.hpp"

#include <cstring>

#include "io/text.hpp"

namespace edgewise::store {
namespace {

constexpr unsigned kOrientationTag = 274;

/// Offset and byte order of the orientation's value in a TIFF block.
struct Place {
    std::size_t at = 0;
    bool big = false;
};

unsigned read(std::span<const std::byte> bytes, std::size_t at, std::size_t width,
              bool big) noexcept {
    unsigned value = 0;
    for (std::size_t i = 0; i < width; ++i)
        value |= std::to_integer<unsigned>(bytes[at + i]) << 8 * (big ? width - 1 - i : i);
    return value;
}

Place find_orientation(std::span<const std::byte> exif) noexcept {
    if (exif.size() < 14) return {};
    const bool big = exif[0] == std::byte{'M'};
    const std::size_t directory = read(exif, 4, 4, big);
    if (directory > exif.size() - 2) return {};
    const unsigned entries = read(exif, directory, 2, big);
    for (std::size_t i = 0; i < entries; ++i) {
        const std::size_t at = directory + 2 + 12 * i;
        if (at + 12 > exif.size()) return {};
        if (read(exif, at, 2, big) == kOrientationTag && read(exif, at + 2, 2, big) == 3)
            return {at + 8, big};
    }
    return {};
}

}  // namespace

int exif_orientation(std::span<const std::byte> exif) noexcept {
    const Place place = find_orientation(exif);
    const unsigned value = place.at ? read(exif, place.at, 2, place.big) : 1;
    return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
}

void set_upright(Bytes& exif) noexcept {
    const Place place = find_orientation(exif);
    if (place.at == 0) return;
    exif[place.at] = std::byte{static_cast<unsigned char>(place.big ? 0 : 1)};
    exif[place.at + 1] = std::byte{static_cast<unsigned char>(place.big ? 1 : 0)};
}

Rows::Rows(std::int64_t width, std::int64_t height, int channels, Type type, int orientation,
           const Selection& pick, std::span<std::byte> into)
    : width_(width),
      channels_(channels),
      first_(pick.channel.value_or(0)),
      kept_(pick.channel ? 1 : channels),
      type_(type),
      size_in_(bytes_of(type)),
      converts_(loaded_type(type, pick.as_stored) != type),
      size_out_(bytes_of(loaded_type(type, pick.as_stored))),
      into_(into) {
    // EXIF 2.3, tag 274: where row 0 and column 0 of the file lie: 2 top right, 3 bottom right,
    // 4 bottom left, 5 left top, 6 right top, 7 right bottom, 8 left bottom.
    const bool swapped = orientation >= 5;
    const std::int64_t out_width = swapped ? height : width;
    const std::int64_t out_height = swapped ? width : height;
    const bool from_right =
        orientation == 2 || orientation == 3 || orientation == 6 || orientation == 7;
    const bool from_bottom =
        orientation == 3 || orientation == 4 || orientation == 7 || orientation == 8;
    const std::int64_t right = from_right ? -1 : 1, below = from_bottom ? -out_width : out_width;
    along_ = swapped ? below : right;
    down_ = swapped ? right : below;
    origin_ = (from_right ? out_width - 1 : 0) + (from_bottom ? (out_height - 1) * out_width : 0);
}

void Rows::put(std::int64_t y, const std::byte* row) {
    std::int64_t pixel = origin_ + y * down_;
    if (!converts_ && kept_ == channels_ && along_ == 1) {
        std::memcpy(into_.data() + static_cast<std::size_t>(pixel * kept_) * size_out_, row,
                    static_cast<std::size_t>(width_ * kept_) * size_in_);
        return;
    }
    for (std::int64_t x = 0; x < width_; ++x, pixel += along_) {
        const std::byte* from = row + static_cast<std::size_t>(x * channels_ + first_) * size_in_;
        std::byte* to = into_.data() + static_cast<std::size_t>(pixel * kept_) * size_out_;
        if (converts_)
            rounding_.convert(type_, from, kept_, to, 1);
        else
            std::memcpy(to, from, static_cast<std::size_t>(kept_) * size_in_);
    }
}

void take_size(Header& header, std::int64_t width, std::int64_t height, int orientation) {
    if (width < 1 || height < 1)
        refuse(header.file, "is " + std::to_string(width) + " x " + std::to_string(height) +
                                " pixels, expected 1 or more");
    header.volume = false;
    header.extent = orientation >= 5 ? Extent{height, width, 1} : Extent{width, height, 1};
    product(header.file, product(header.file, width, height), 64);
}

}  // namespace edgewise::store
