#pragma once

#include <span>

#include "graph/request.hpp"
#include "reference/ray_look.hpp"

namespace edgewise {

// Pixels of modes with a threshold jump from one answer to another. Where an algorithm is hardly
// wrong, few do: fewer than the pixels that are drawn. How many there are is told from rays that
// nearly jump. If decisive values lie as densely at the level as within some distance of it, the
// share of levels there at which a ray would jump is the share of rays that jump at the level.

/// How far the level of a picture lies below the one that was asked for [value]: by more than
/// values of the input's magnitude are rounded by.
inline double lowered_by(const Request& want) noexcept {
    return want.mode->takes_level ? 1e-6 * want.magnitude : 0;
}

/// What counts as near a level.
struct Nearby {
    double within = 0;    // so far from it [value]; 0: jumps at the level itself are counted
    double rounding = 0;  // decisive values are known to this [value]
    double plateau = 0;   // how far samples of the level that was asked for lie beyond it [value]
};

/// The share of levels within `nearby` of a level that lie between two values, as these lie beyond
/// that level. NaN: none.
double share_between(double a, double b, const Nearby& nearby) noexcept;
/// The same of levels above it alone, for what is only known where the first value reaches it.
double share_above(double a, double b, const Nearby& nearby) noexcept;
/// As near the level as there are rays enough to tell how densely they lie, by the guess, without
/// those of plateaus. 0: the mode has no threshold.
double nearby_of(std::span<const RayLook> looks, double plateau);
/// Makes squares those of jumps, for the share of levels within a distance.
void count_nearby(RayLook& look, double within) noexcept;

}  // namespace edgewise
