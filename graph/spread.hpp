#pragma once

#include <array>

#include "graph/representation.hpp"

namespace edgewise {

/// Whether samples are cut over ranks, by columns or by slice and dice.
inline bool is_spread(const Representation& what) noexcept {
    return what.place == Place::ranks &&
           (what.layout == Layout::columns || what.layout == Layout::diced);
}

/// Whether all samples lie in the memory of one rank, row by row.
inline bool is_whole(const Representation& what) noexcept {
    return what.place == Place::memory && what.layout == Layout::linear;
}

/// How many ranks lie along x, y and z where a box of samples is cut evenly over them.
using Cut = std::array<int, 3>;

/// The cut of a layout ([W93] 3.8, FIGURE 41): columns along x and y only, slice and dice along
/// every axis of the samples, as evenly as the factors of `ranks` allow (1024 = 16 x 8 x 8).
/// Anything else lies at one rank.
Cut cut_of(Layout layout, const Extent& extent, int axes, int ranks);

/// What a map does to samples that are spread over ranks.
struct Moves {
    double seen = 1;  // share of samples whose image lies in the other box
    double meet = 1;  // accesses that a rank gets at once where an even network would bring it one
};

/// Samples of `from`, mapped into the box of `to` (4x4, index to index), both cut by `layout`.
/// Shares come from a lattice of some hundred samples. Ranks work in step, each on the same place
/// of its own box: by columns the ranks of a step are a plane z = constant, whose image is squeezed
/// by the cofactor of z, until it is so thin that only a line of ports takes part. Slice and dice
/// keeps a step spread over all of the volume, so accesses do not meet.
Moves moves_of(const Mat4& map, const Extent& from, const Extent& to, int axes, Layout layout,
               int ranks);

/// Samples around a rank's box, `halo` wide, that it holds for its neighbours.
double halo_samples(const Extent& extent, const Cut& cut, int halo);

}  // namespace edgewise
