#include "transitions/project/splat_ewa_view.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "transitions/project/picture.hpp"

namespace edgewise {

using kernels::EwaSplat;

EwaSplat ewa_view_of(const Representation& from, const Request& want, int view,
                     const Parameters& with) {
    const Mat4 map = residual(from, want, view);
    const auto place = [&map](int row, double shift) {
        return kernels::PlaceOnScreen{map(row, 3) - shift, {map(row, 0), map(row, 1), map(row, 2)}};
    };
    EwaSplat splat;
    splat.screen = {place(0, 0), place(1, 0)};
    splat.variance = std::pow(with.number("sigma"), 2);
    splat.low_pass = std::pow(with.number("lowpass"), 2);
    splat.mass = std::abs(map.topLeftCorner<3, 3>().determinant());
    if (!want.eye) return splat;
    splat.depth = place(2, want.eye->at.z());
    splat.plane = want.eye->plane - want.eye->at.z();
    for (std::size_t i = 0; i < 2; ++i) {
        const int side = static_cast<int>(i);
        splat.eye[i] = want.eye->at[side];
        splat.least[i] = (-0.5 - splat.eye[i]) / splat.plane;
        splat.greatest[i] =
            (static_cast<double>(want.screen[side]) - 0.5 - splat.eye[i]) / splat.plane;
    }
    return splat;
}

namespace {

/// The longest of a voxel's sides, in steps along screen z.
double longest_side(const Mat4& map, const Eye& eye) {
    double longest = 0;
    for (int axis = 0; axis < 3; ++axis)
        longest = std::max(
            longest,
            Vec3(map(0, axis) * eye.width, map(1, axis) * eye.height, map(2, axis)).norm());
    return longest;
}

}  // namespace

std::string no_ewa_distance(const Representation& from, const Request& want, int view) {
    constexpr double kNearest = 8;  // spacings
    const Mat4 map = residual(from, want, view);
    double nearest = map(2, 3) - want.eye->at.z();
    for (int axis = 0; axis < 3; ++axis)
        nearest += std::min(0.0, map(2, axis) * static_cast<double>(from.extent[axis] - 1));
    const double spacings = nearest / longest_side(map, *want.eye);
    if (spacings >= kNearest && want.eye->plane > want.eye->at.z()) return {};
    if (!(spacings > 0))
        return fmt::format("view {}: samples lie beside the eye or behind it", view);
    return fmt::format(
        "view {}: the eye is {:.3g} spacings before the nearest samples, whose rays are not nearly "
        "parallel; at least {}",
        view, spacings, kNearest);
}

std::array<double, 2> ewa_spread_of(const EwaSplat& splat, const Extent& n) {
    const auto middle = [&](const kernels::PlaceOnScreen& place) {
        return place.of(double(n.x - 1) / 2, double(n.y - 1) / 2, double(n.z - 1) / 2);
    };
    const double larger = splat.plane / middle(splat.depth);
    std::array<double, 2> spread{};
    for (std::size_t i = 0; i < 2; ++i) {
        const double slope = (middle(splat.screen[i]) - splat.eye[i]) / middle(splat.depth);
        for (std::size_t axis = 0; axis < 3; ++axis)
            spread[i] += std::pow(
                larger * (splat.screen[i].voxel[axis] - slope * splat.depth.voxel[axis]), 2);
    }
    return spread;
}

}  // namespace edgewise
