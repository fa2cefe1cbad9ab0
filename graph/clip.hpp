#pragma once

#include <algorithm>
#include <array>
#include <cmath>
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

/// A ball of input indices; where samples are not as far apart along all axes, an ellipsoid.
struct Ball {
    Vec3 centre = Vec3::Zero();
    /// From the centre to a point, as it is where the ball has the radius 1.
    Eigen::Matrix3d to_unit = Eigen::Matrix3d::Identity();

    Vec3 from_centre(const Vec3& p) const noexcept { return to_unit * (p - centre); }
    bool has(const Vec3& p) const noexcept { return from_centre(p).squaredNorm() <= 1; }
    /// How far it reaches from its centre along each axis.
    Vec3 reach() const;
};

/// The part of an input that rays see: what a box, half spaces and balls have in common, so it is
/// convex.
struct Clip {
    Vec3 low, high;                 // faces of the box [input index], within those of the input
    std::vector<HalfSpace> planes;  // none that keeps all of the box
    std::vector<Ball> balls;        // likewise
    Vec3 least, most;               // corners of a box around what is kept; the smallest, of planes
    double volume = 0;              // of what is kept [sample]; 0: nothing is

    bool keeps_all(const Extent& input) const noexcept;
};

/// What half spaces and balls keep of an input. Planes that are parallel to an axis become faces of
/// the box, so that a box says the same by planes. With balls the volume is a sum over lines, off
/// by about a thousandth.
Clip clip_of(const Extent& input, std::span<const HalfSpace> planes,
             std::span<const Ball> balls = {});

/// All that a clip says but its balls, as half spaces, one after another: f(HalfSpace).
template <typename F>
void for_each_half_space(const Clip& clip, F f) {
    for (const HalfSpace& plane : clip.planes) f(plane);
    for (int axis = 0; axis < 3; ++axis) {
        f(HalfSpace{Vec3::Unit(axis), -clip.low[axis]});
        f(HalfSpace{-Vec3::Unit(axis), clip.high[axis]});
    }
}
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

/// Cuts [low, high] of a line to a ball of radius 1 around 0. A line that only touches it misses.
/// @param from,along  from + t along is on the line
inline void cut_by_ball(const std::array<double, 3>& from, const std::array<double, 3>& along,
                        double& low, double& high) noexcept {
    double square = 0, across = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        square += along[axis] * along[axis];
        across += from[axis] * along[axis];
    }
    // By way of the place that is nearest to the centre: from far away both solutions of the
    // quadratic equation would be differences of large numbers.
    const double middle = -across / square;
    double left = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double nearest = from[axis] + middle * along[axis];
        left -= nearest * nearest;
    }
    if (!(left > 0)) {
        high = low;
        return;
    }
    const double half = std::sqrt(left / square);
    low = std::max(low, middle - half);
    high = std::min(high, middle + half);
}

}  // namespace edgewise
