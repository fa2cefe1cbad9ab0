#pragma once

#include <span>
#include <vector>

#include "graph/representation.hpp"

namespace edgewise {

/// The half space normal . p + offset >= 0 of input indices.
struct HalfSpace {
    Vec3 normal = Vec3::UnitX();  // of length one
    double offset = 0;            // [sample]

    double at(const Vec3& p) const noexcept { return normal.dot(p) + offset; }
};

/// The part of an input that rays see: what a box and half spaces have in common, so it is convex.
struct Clip {
    Vec3 low, high;                 // faces of the box [input index], within those of the input
    std::vector<HalfSpace> planes;  // none that keeps all of the box
    Vec3 least, most;               // corners of the smallest box around what is kept
    double volume = 0;              // of what is kept [sample]; 0: nothing is

    bool keeps_all(const Extent& input) const noexcept;
};

/// What half spaces keep of an input. Those that are parallel to an axis become faces of the box,
/// so that a box says the same by planes.
Clip clip_of(const Extent& input, std::span<const HalfSpace> planes);

/// All that a clip says, as half spaces.
std::vector<HalfSpace> half_spaces_of(const Clip& clip);

/// A line along a plane, but for rounding: its distance changes by less than this in one unit.
inline constexpr double kAlongPlane = 1e-12;
/// Such a line is inside where it is no farther out than this, so that rounding does not decide
/// about rays in a plane [sample].
inline constexpr double kInPlane = 1e-9;

/// Cuts [low, high] of a line to a half space. @param base,slope  base + t slope >= 0 is inside
inline void cut_by_plane(double base, double slope, double& low, double& high) noexcept {
    if (slope < kAlongPlane && slope > -kAlongPlane) {
        if (base < -kInPlane) high = low;
        return;
    }
    const double at = -base / slope;
    if (slope > 0)
        low = at > low ? at : low;
    else
        high = at < high ? at : high;
}

}  // namespace edgewise
