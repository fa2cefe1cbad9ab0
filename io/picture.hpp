#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "io/reader.hpp"

namespace edgewise::store {

/// Orientation tag (274) of an EXIF block, 1..8; 1 where it is absent or damaged.
int exif_orientation(std::span<const std::byte> exif) noexcept;
/// Sets the tag to 1: samples in memory are upright already.
void set_upright(Bytes& exif) noexcept;

/// Where the rows of a picture go: upright by EXIF orientation, one channel or all.
class Rows {
 public:
    /// @param width,height of the file's own rows
    Rows(std::int64_t width, std::int64_t height, int channels, Type type, int orientation,
         const Selection& pick, std::span<std::byte> into);
    /// One row of the file in native byte order: width * channels numbers of the file's type.
    void put(std::int64_t y, const std::byte* row);
    void tell(const std::string& file, std::vector<Message>& warnings) const {
        rounding_.tell(file, type_, warnings);
    }

 private:
    std::int64_t width_, channels_, first_, kept_;
    Type type_;
    std::size_t size_in_;
    bool converts_;
    std::size_t size_out_;
    std::int64_t origin_ = 0, along_ = 1, down_ = 1;  // in pixels of the output
    std::span<std::byte> into_;
    Rounding rounding_;
};

/// Sets extent of an image, swapped where its orientation lies on its side.
void take_size(Header&, std::int64_t width, std::int64_t height, int orientation);

}  // namespace edgewise::store
