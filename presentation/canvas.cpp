#include "presentation/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace edgewise {

Canvas::Canvas(int wide, int high, int parts)
    : width(wide),
      height(high),
      channels(parts),
      samples(static_cast<std::size_t>(wide) * static_cast<std::size_t>(high) *
              static_cast<std::size_t>(parts)) {}

void Canvas::blend(int x, int y, const Colour& colour, double share) noexcept {
    if (x < 0 || y < 0 || x >= width || y >= height || !(share > 0)) return;
    std::uint8_t* pixel = at(x, y);
    const int colours = channels < 3 ? 1 : 3;
    for (int c = 0; c < colours; ++c) {
        const double to = colour[static_cast<std::size_t>(c)];
        pixel[c] = static_cast<std::uint8_t>(std::lround(pixel[c] + share * (to - pixel[c])));
    }
    if (channels > colours)
        pixel[colours] =
            static_cast<std::uint8_t>(std::lround(pixel[colours] + share * (255 - pixel[colours])));
}

void Canvas::fill(int x, int y, int wide, int high, const Colour& colour) noexcept {
    for (int row = y; row < y + high; ++row)
        for (int column = x; column < x + wide; ++column) blend(column, row, colour, 1);
}

void Canvas::fill(std::span<const std::uint8_t> pixel) noexcept {
    for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = pixel[i % pixel.size()];
}

void Canvas::put(int x, int y, int wide, int high, std::span<const std::uint8_t> picture) noexcept {
    const auto line = static_cast<std::size_t>(wide) * static_cast<std::size_t>(channels);
    for (int row = 0; row < high; ++row)
        std::memcpy(at(x, y + row), picture.data() + static_cast<std::size_t>(row) * line, line);
}

}  // namespace edgewise
