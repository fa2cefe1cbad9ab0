#pragma once

#include <string>
#include <vector>

#include "charts/table.hpp"

namespace edgewise::charts {

/// How the marks of a family look: by colour and by shape, so that neither is needed.
struct Style {
    const char* colour;  // "#rrggbb"
    const char* shape;   // circle, square, up, down, diamond or pentagon
    int gnuplot;         // its hollow point type; the next is filled
};

/// The families of a table, in the order in which they appear.
std::vector<std::string> families_of(const Table& table);

/// Of the family at a place of that list. Colours are those of Okabe and Ito (2008), which people
/// who see no red or no green tell apart; the shapes have another period, so that only after 42
/// families a pair comes again.
Style style_of(std::size_t place) noexcept;

}  // namespace edgewise::charts
