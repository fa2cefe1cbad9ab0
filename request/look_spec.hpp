#pragma once

#include <array>
#include <optional>
#include <string>

namespace edgewise {

struct Query;

/// How values become a picture for people, beside the window. All of it makes views of 8 bits.
struct LookSpec {
    std::string colormap;                       // a name or a file; "": grey
    bool legend = false;                        // colours and their values, in a strip at the right
    bool scale_bar = false;                     // a length, at the lower left of each picture
    bool depth_colour = false;                  // hue by the depth of the value
    std::optional<std::array<int, 2>> montage;  // columns and rows of one sheet

    bool empty() const noexcept {
        return colormap.empty() && !legend && !scale_bar && !depth_colour && !montage;
    }
    /// Whether colours stand for numbers, one a pixel.
    bool colours() const noexcept { return !colormap.empty() || legend || depth_colour; }
};

/// @throws RequestError what such a request cannot have
void expect_look(const Query& query);

}  // namespace edgewise
