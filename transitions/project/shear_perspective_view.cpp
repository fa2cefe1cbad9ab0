#include "transitions/project/shear_perspective_view.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "transitions/project/picture.hpp"

namespace edgewise {
namespace {

using kernels::PerspectiveSlices;

/// An interval of places or slopes; empty: low > high.
struct Between {
    double low = 1, high = 0;

    bool empty() const { return !(low <= high); }
    Between within(const Between& other) const {
        return {std::max(low, other.low), std::min(high, other.high)};
    }
    template <std::size_t n>
    static Between of(const std::array<double, n>& values) {
        const auto [least, most] = std::minmax_element(values.begin(), values.end());
        return {*least, *most};
    }
};

double high_face_of(const Extent& n, int axis) { return static_cast<double>(n[axis]) - 0.5; }

/// Directions of rays at the corners of a box of the picture.
std::array<std::array<double, 3>, 4> corner_rays(const kernels::Rays& rays, const Region& picture) {
    std::array<std::array<double, 3>, 4> all;
    for (std::size_t corner = 0; corner < 4; ++corner)
        all[corner] = rays.direction.at(
            static_cast<double>(corner & 1 ? picture.end[0] - 1 : picture.begin[0]),
            static_cast<double>(corner & 2 ? picture.end[1] - 1 : picture.begin[1]));
    return all;
}

/// What rays of a box of the picture go across for a voxel along an axis. They are a convex cone,
/// of which the corners tell all where they all go the same way. Nothing: they do not.
std::optional<Between> slopes_of(const kernels::Rays& rays, const Region& picture, const Way& way,
                                 int across) {
    std::array<double, 4> slopes;
    const auto corners = corner_rays(rays, picture);
    for (std::size_t corner = 0; corner < 4; ++corner) {
        const auto& d = corners[corner];
        const double along = d[static_cast<std::size_t>(way.axis)];
        if (!((way.backwards ? -along : along) > 0)) return {};
        slopes[corner] = d[static_cast<std::size_t>(across)] / std::abs(along);
    }
    const Between all = Between::of(slopes);
    if (!std::isfinite(all.low) || !std::isfinite(all.high)) return {};
    return all;
}

/// Where the volume begins and ends along a way, from the eye on; beside the eye it begins at 0.
Between ahead_of(const PerspectiveView& of, const Extent& n, const Way& way) {
    const double eye = of.eye()[static_cast<std::size_t>(way.axis)];
    const double low = -0.5 - eye, high = high_face_of(n, way.axis) - eye;
    return {std::max(0.0, way.backwards ? -high : low), way.backwards ? -low : high};
}
/// How far the volume is from the eye along an axis.
double away_from(const PerspectiveView& of, const Extent& n, int axis) {
    return std::max(ahead_of(of, n, {axis, false}).low, ahead_of(of, n, {axis, true}).low);
}
/// Rays of a way go no faster across it, so they meet nothing that is nearer than this.
double first_met(const PerspectiveView& of, const Extent& n, const Way& way) {
    double met = ahead_of(of, n, way).low;
    for (const int other : axes_across(way.axis)) met = std::max(met, away_from(of, n, other));
    return met;
}

/// What rounding decides between axes that are equally fast.
constexpr double kEqual = 1e-6;

/// Whether rays of the picture may advance fastest along a way where they meet the volume; where
/// that is not easily told, they may.
bool is_needed(const PerspectiveView& of, const Extent& n, const Region& picture, const Way& way) {
    if (ahead_of(of, n, way).high < (1 - kEqual) * first_met(of, n, way)) return false;
    const auto corners = corner_rays(of.rays, picture);
    const auto parts = [&](int axis) {
        std::array<double, 4> values;
        for (std::size_t corner = 0; corner < 4; ++corner)
            values[corner] = corners[corner][static_cast<std::size_t>(axis)];
        return Between::of(values);
    };
    const Between along = parts(way.axis);
    const double fastest = way.backwards ? -along.low : along.high;
    if (!(fastest > 0)) return false;
    for (const int other : axes_across(way.axis)) {
        const Between across = parts(other);
        const double least = std::max({across.low, -across.high, 0.0});
        if (fastest < (1 - kEqual) * least) return false;
    }
    return true;
}

/// The image on which the slices along a way are combined; nothing where no ray reaches them.
/// @param density  pixels on a voxel of the first slice that rays may meet
std::optional<SlicedView> sliced_view(const PerspectiveView& of, const Extent& n, const Mat4& map,
                                      const Vec3& steps, const Region& picture, const Way& way,
                                      double density) {
    const double eye = of.eye()[static_cast<std::size_t>(way.axis)];
    const double met = first_met(of, n, way), end = ahead_of(of, n, way).high;
    const auto last = static_cast<double>(n[way.axis] - 1);
    // Pixels beside those at 45 degrees see rays that are steeper by one.
    const double near = std::max(met - 1 / density, met / 2);
    const double slice = way.backwards ? std::clamp(std::floor(eye - near), 0.0, last)
                                       : std::clamp(std::ceil(eye + near), 0.0, last);
    SlicedView made;
    PerspectiveSlices& slices = made.slices;
    slices.backwards = way.backwards;
    slices.distance = std::abs(slice - eye);
    // Rays that enter before it do so by a side of the volume.
    const bool cut = slice != (way.backwards ? last : 0.0);
    slices.front = cut ? -1 : -0.5;
    made.first = way.backwards ? 0 : static_cast<std::int64_t>(slice);
    const auto count = static_cast<std::int64_t>(way.backwards ? slice : last - slice) + 1;
    const std::array<int, 2> across = axes_across(way.axis);
    slices.volume.extent = {n[across[0]], n[across[1]], count};
    std::array<std::int64_t, 2> size{};
    for (std::size_t a = 0; a < 2; ++a) {
        const double foot = of.eye()[static_cast<std::size_t>(across[a])];
        const double low = -0.5 - foot, high = high_face_of(n, across[a]) - foot;
        Between slopes =
            Between::of(std::array<double, 4>{low / met, low / end, high / met, high / end});
        slopes = slopes.within({-1 - kEqual, 1 + kEqual});
        if (const auto seen = slopes_of(of.rays, picture, way, across[a]))
            slopes = slopes.within(*seen);
        if (slopes.empty()) return {};
        // Whole pixels from sample 0 on, and one more on either side.
        const auto pixel = [&](double slope) { return (foot + slices.distance * slope) * density; };
        const double first = std::floor(pixel(slopes.low) - kEqual) - 1;
        const double behind = std::ceil(pixel(slopes.high) + kEqual) + 2;
        slices.across[a] = {first / density, 1 / density, foot};
        size[a] = static_cast<std::int64_t>(behind - first);
    }
    made.image = {size[0], size[1], 1};
    // From slice to slice in t; see rays_of().
    const Eigen::Matrix3d length = steps.asDiagonal() * map.topLeftCorner<3, 3>();
    const Vec3 u = length.col(across[0]), v = length.col(across[1]);
    const Vec3 w = (way.backwards ? -1.0 : 1.0) * length.col(way.axis);
    slices.metric = {u.dot(u), v.dot(v), w.dot(w), u.dot(v), u.dot(w), v.dot(w)};
    return made;
}

}  // namespace

PerspectiveView perspective_view(const Representation& from, const Request& want, int view,
                                 double density) {
    PerspectiveView of{.rays = rays_of(from, want, view), .along = {}, .refused = {}};
    const Extent& n = from.extent;
    double away = 0;
    for (int axis = 0; axis < 3; ++axis) away = std::max(away, away_from(of, n, axis));
    // Nearer rays would be too far apart in slices that are not as near.
    constexpr double kNearest = 1;
    if (!(away >= kNearest)) {
        of.refused =
            away > 0
                ? fmt::format("view {}: the eye is {:.3g} voxels away from the volume; at least {}",
                              view, away, kNearest)
                : fmt::format(
                      "view {}: the eye is inside the volume, slices lie before and behind "
                      "it",
                      view);
        return of;
    }
    const Mat4 map = residual(from, want, view);
    const Vec3 steps(want.eye->width, want.eye->height, 1);
    const Region picture = Region::all(want.output());
    for (const Way& way : kWays)
        if (is_needed(of, n, picture, way))
            of.along[way.index()] = sliced_view(of, n, map, steps, picture, way, density);
    return of;
}
/// The box of an image that a box of the picture is read from.
Region box_of_slices(const SlicedView& of, const kernels::Rays& rays, const Region& picture,
                     const Way& way) {
    Region box = Region::all(of.image);
    const std::array<int, 2> across = axes_across(way.axis);
    for (std::size_t a = 0; a < 2; ++a) {
        const auto slopes = slopes_of(rays, picture, way, across[a]);
        if (!slopes) continue;
        const auto& [first, pitch, foot] = of.slices.across[a];
        const auto end = static_cast<double>(box.end[a]);
        const double low = (foot + of.slices.distance * slopes->low - first) / pitch;
        const double high = (foot + of.slices.distance * slopes->high - first) / pitch;
        box.begin[a] = static_cast<std::int64_t>(std::clamp(std::floor(low) - 1, 0.0, end));
        box.end[a] = static_cast<std::int64_t>(std::clamp(std::ceil(high) + 2, 0.0, end));
    }
    return box.begin[0] < box.end[0] && box.begin[1] < box.end[1] ? box : Region{};
}

SlicedAxes sliced_axes(const Representation& from, const Request& want) {
    SlicedAxes axes;
    for (int variant = 0; variant < want.views.different(); ++variant) {
        PerspectiveView of = perspective_view(from, want, want.views.first_view(variant), 1);
        if (!of.refused.empty()) return {.needed = {}, .refused = std::move(of.refused)};
        for (const Way& way : kWays)
            if (of.along[way.index()]) axes.needed[static_cast<std::size_t>(way.axis)] = true;
    }
    return axes;
}

}  // namespace edgewise
