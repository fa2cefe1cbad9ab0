#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace edgewise {

/// Colours for shares from 0 to 1, linear between rows that lie equally far apart.
class Colormap {
 public:
    using Colour = std::array<double, 3>;  // red, green, blue, 0 to 1

    Colormap() : rows_{{0, 0, 0}, {1, 1, 1}} {}
    /// @param rows  at least two
    explicit Colormap(std::vector<Colour> rows) : rows_(std::move(rows)) {}

    Colour at(double share) const noexcept;
    /// Rounded to 8 bits.
    std::array<std::uint8_t, 3> bytes_at(double share) const noexcept;

 private:
    std::vector<Colour> rows_;
};

/// viridis, magma, inferno, plasma: matplotlib's tables (CC0); hot, jet: its formulas; grey; hue:
/// from red over green to blue.
const std::vector<std::string>& colormap_names();

/// One of these, in any case, or that of a file: text with a row of red, green and blue a line
/// (blanks, commas or semicolons between; of four numbers the first is a row's number; 0 to 255
/// where any is above 1), ImageJ's .lut of 768 bytes, a list of such rows in JSON, or a transfer
/// function (docs/files.md), of which the colours are taken.
/// @throws RequestError
Colormap colormap_of(const std::string& name);

}  // namespace edgewise
