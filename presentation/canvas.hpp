#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace edgewise {

/// A picture of 8 bits to draw on.
struct Canvas {
    using Colour = std::array<std::uint8_t, 3>;

    /// Black, and transparent where there is alpha.
    Canvas(int width, int height, int channels);

    int width = 0, height = 0;
    int channels = 3;  // 1: grey, 3: colours, 2 and 4: with alpha
    std::vector<std::uint8_t> samples;

    std::uint8_t* at(int x, int y) noexcept {
        return samples.data() + static_cast<std::size_t>(channels) *
                                    (static_cast<std::size_t>(x) +
                                     static_cast<std::size_t>(width) * static_cast<std::size_t>(y));
    }
    /// Puts a colour over a pixel, by a share of 0 to 1; nothing beyond the ends.
    void blend(int x, int y, const Colour& colour, double share) noexcept;
    /// From x, y on.
    void fill(int x, int y, int wide, int high, const Colour& colour) noexcept;
    /// All of it with one pixel, which has as many channels.
    void fill(std::span<const std::uint8_t> pixel) noexcept;
    /// Puts another picture there, which has as many channels.
    void put(int x, int y, int wide, int high, std::span<const std::uint8_t> picture) noexcept;
};

/// Text in DejaVu Sans, by FreeType.
/// @param height  of a capital letter, about [pixel]
struct TextSize {
    int width = 0, above = 0, below = 0;  // of the line it stands on [pixel]
};
/// @throws RunError a build without FreeType
TextSize text_size(const std::string& text, double height);
/// @param x,y  where it begins, on the line it stands on
void draw_text(Canvas& canvas, int x, int y, const std::string& text, double height,
               const Canvas::Colour& colour);
/// Whether this build can draw text.
bool can_draw_text() noexcept;

}  // namespace edgewise
