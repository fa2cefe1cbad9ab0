#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace edgewise::store {

using Rgb = std::array<std::uint8_t, 3>;

/// At most 256 colours of a picture.
struct Palette {
    std::vector<Rgb> colours;
    bool exact = true;  // the picture has no others
};

/// All colours of a picture, or 256 that are close to them: the box of colours with the largest sum
/// of squares about its mean is divided there until there are as many (Wan et al. 1990). The first
/// is the picture's corner, so that a background stays as it is.
/// @param pixels  red, green, blue
Palette palette_of(std::span<const std::uint8_t> pixels);

/// Places of pixels in a palette, row by row. Of an inexact one errors are spread to the pixels
/// that follow (Floyd and Steinberg 1976); a colour that the palette has is taken as it is.
class Indexed {
 public:
    Indexed(const Palette& palette, std::size_t width);
    /// The next row. @param pixels  red, green, blue; @param places  one a pixel
    void row(std::span<const std::uint8_t> pixels, std::span<std::uint8_t> places);

 private:
    std::uint8_t nearest(const std::array<int, 3>& colour);

    const Palette& palette_;
    std::vector<std::pair<std::uint32_t, std::uint8_t>> sorted_;  // colours and their places
    std::vector<std::int16_t>
        near_;  // place nearest to six bits of each channel; -1: not known yet
    std::vector<std::array<int, 3>> error_, below_;  // sixteenths, of this row and the next
};

}  // namespace edgewise::store
