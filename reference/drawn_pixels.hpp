#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "reference/error_tally.hpp"
#include "reference/ray_look.hpp"

namespace edgewise {

/// Pixels that errors of pictures are measured at, drawn where they are likely to be large.
///
/// Squares of errors have heavy tails: a few pixels at edges carry them, and a hundred that are
/// drawn evenly contain too few of those. So the errors of some thousands are estimated cheaply
/// first (ray_look.hpp). Then cells of neighbours are drawn and measured together, half of them
/// evenly and half in proportion to the estimated errors. Each counts by the inverse of its
/// probability (Horvitz, Thompson 1952; in two phases: Cochran 1977, 12.9). A regression on the
/// estimates of all pixels then reduces the variance of the draws
/// (error_tally.hpp).
struct DrawnPixels {
    struct Cell {
        OutputSample corner;
        double weight = 1;  // for all of the cell together; mean 1, about
        double chance = 1;  // probability that it was drawn in the second phase
    };
    struct Looked {
        OutputSample at;
        RayLook look;
    };
    std::vector<Cell> drawn;     // each once
    std::vector<Looked> looked;  // none where all that there is was drawn
    double pixels = 0;           // of all views that the draws stand for, about
    bool whole = false;          // all of them are drawn
    /// Of modes with a threshold: looks count jumps at levels so near (jumps.hpp) [value].
    double nearby = 0;

    /// Of the pixels that the draws stand for.
    double share_looked() const {
        return pixels > 0 ? std::min(1.0, static_cast<double>(looked.size()) / pixels) : 0;
    }
    std::array<Auxiliary, RayLook::kCasts> auxiliaries() const;
};

/// How often each of a list is drawn on average where half of the draws are even and half go in
/// proportion to a roughness; at most once.
/// @param draws  less than there are in the list
std::vector<double> expected_draws(std::span<const double> rough, double draws);

/// One of a list, and how likely it was to be drawn.
struct RoughDraw {
    std::size_t place;
    double chance;
    double weight;  // its inverse: mean 1, about
};
/// Half of the draws are even, half go in proportion to a roughness.
/// @param draws  less than there are in the list
/// @return in increasing roughness
std::vector<RoughDraw> draw_in_proportion(std::span<const double> rough, double draws);

/// Draws from pixels whose rays meet the input.
/// @param from   spread evenly over their population; any of them may be drawn
/// @param draws  cells, at most about so many; all of them where there are no more
/// @param side   of a cell [pixel]
/// @return in increasing roughness, without `pixels`; the same for any number of threads
DrawnPixels draw_rough(const Request& want, const ReferenceField& field,
                       const ViewGeometry& geometry, std::span<const OutputSample> from,
                       double draws, int side);

/// At most so many of a list, at equal distances.
std::vector<OutputSample> some_of(std::span<const OutputSample> from, std::size_t most);

/// Of all pixels but those of short rays (preview_short.hpp).
/// @param fewest, most  cells; between them as many as a ray of each are together `length` long
///                      [unit]
/// @param times  so many times the draws, of so many times the pixels that are looked at
DrawnPixels draw_pixels(const Request& want, const ReferenceField& field,
                        const ViewGeometry& geometry, int fewest, int most, double length, int side,
                        double times = 1);

}  // namespace edgewise
