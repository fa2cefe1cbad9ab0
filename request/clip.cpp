#include "request/clip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "graph/clip.hpp"
#include "graph/errors.hpp"

namespace edgewise {
namespace {

constexpr std::size_t kMostPlanes = 64, kMostBalls = 64;  // each costs every ray an intersection

/// A plane with a normal of length one. One along an axis is exactly so.
HalfSpace half_space(const Vec3& normal, double offset) {
    // Large and small numbers have squares that overflow.
    const double most = normal.cwiseAbs().maxCoeff();
    const double length = most * (normal / most).norm();
    return {normal / length, offset / length};
}

void add_box(const std::array<double, 6>& box, std::vector<HalfSpace>& planes) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        if (!std::isfinite(box[k]) || !std::isfinite(box[k + 3]))
            throw RequestError(message("@box({}): expected finite numbers", fmt::join(box, ",")));
        if (box[k] > box[k + 3])
            throw RequestError(message("@box({}): {} begins behind its end, {} > {}",
                                       fmt::join(box, ","), "XYZ"[axis], box[k], box[k + 3]));
        // A sample fills half a voxel to either side.
        planes.push_back({Vec3::Unit(axis), 0.5 - box[k]});
        planes.push_back({-Vec3::Unit(axis), box[k + 3] + 0.5});
    }
}

void add_plane(const std::array<double, 4>& plane, std::vector<HalfSpace>& planes) {
    const Vec3 normal(plane[0], plane[1], plane[2]);
    if (!normal.allFinite() || !std::isfinite(plane[3]))
        throw RequestError(message("@planes({}): expected finite numbers", fmt::join(plane, ",")));
    if (normal.isZero(0))
        throw RequestError(message("@planes({}): A, B and C are 0, so the plane has no direction",
                                   fmt::join(plane, ",")));
    planes.push_back(half_space(normal, plane[3]));
}

/// @param axes  columns: one sample along x, y and z [file unit]
Ball ball_of(const std::array<double, 4>& ball, const Mat3& axes) {
    const Vec3 centre(ball[0], ball[1], ball[2]);
    if (!centre.allFinite() || !std::isfinite(ball[3]))
        throw RequestError(message("@balls({}): expected finite numbers", fmt::join(ball, ",")));
    if (!(ball[3] > 0))
        throw RequestError(message("@balls({}): the radius is {}; expected more than 0",
                                   fmt::join(ball, ","), ball[3]));
    // Beyond, rounding would decide about rays.
    constexpr double kFar = 1e9, kSmall = 1e-6;
    const Vec3 steps = axes.colwise().norm();
    if (centre.cwiseAbs().maxCoeff() > kFar || ball[3] < kSmall * steps.minCoeff() ||
        ball[3] > kFar * steps.minCoeff())
        throw RequestError(
            message("@balls({}): expected a centre within {:g} samples and a radius of {:g} to "
                    "{:g} of the smallest spacing",
                    fmt::join(ball, ","), kFar, kSmall, kFar));
    return {centre, axes / ball[3]};
}

/// What is no farther than half the thickness from the middle plane: where the middle of the turn
/// is, parallel to the picture. From an eye that has a place of its own: no deeper than the
/// thickness.
void add_slab(double thickness, const Mat4& view, const Geometry& geometry,
              std::vector<HalfSpace>& planes) {
    // The depth of an input index from there [file unit]: along . p + at.
    const Vec3 along = geometry.unit * Vec3(view.row(2).head<3>());
    const double middle = (static_cast<double>(geometry.grid.extent.z) - 1) / 2;
    const double at = geometry.unit * (view(2, 3) - middle) + geometry.grid.centre.z();
    const double before = geometry.eye_placed ? 0 : thickness / 2;
    planes.push_back(half_space(along, before + at));
    planes.push_back(half_space(-along, thickness - before - at));
}

}  // namespace

void take_clip(Request& want, const ClipSpec& spec, const InputGrid& grid,
               const Geometry& geometry) {
    want.clips.clear();
    if (spec.empty()) return;
    if (!want.job->of_rays())
        throw RequestError(message(
            "@box, @planes, @balls and @slab: of render; they cut rays, which a warp has none of"));
    if (spec.planes.size() > kMostPlanes)
        throw RequestError(
            message("@planes: {} are given; at most {}", spec.planes.size(), kMostPlanes));
    if (spec.balls.size() > kMostBalls)
        throw RequestError(
            message("@balls: {} are given; at most {}", spec.balls.size(), kMostBalls));
    std::vector<HalfSpace> planes;
    std::vector<Ball> balls;
    const Mat3 axes = grid.lean * grid.spacing.asDiagonal();
    for (const auto& ball : spec.balls) balls.push_back(ball_of(ball, axes));
    if (spec.box) add_box(*spec.box, planes);
    for (const auto& plane : spec.planes) add_plane(plane, planes);
    if (spec.slab && !(*spec.slab > 0 && std::isfinite(*spec.slab)))
        throw RequestError(
            message("@slab: {} given; expected a thickness greater than 0", *spec.slab));
    const std::size_t views = spec.slab ? geometry.views.size() : 1;
    for (std::size_t view = 0; view < views; ++view) {
        std::vector<HalfSpace> all = planes;
        if (spec.slab) add_slab(*spec.slab, geometry.views[view], geometry, all);
        want.clips.push_back(clip_of(want.input, all, balls));
    }
    const auto is_empty = [](const Clip& clip) { return clip.volume == 0; };
    if (std::all_of(want.clips.begin(), want.clips.end(), is_empty))
        throw RequestError(
            message("{}: keeps nothing of the volume, whose samples are 0,0,0 to {},{},{}",
                    spec.settings(), want.input.x - 1, want.input.y - 1, want.input.z - 1));
    const auto is_whole = [&](const Clip& clip) { return clip.keeps_all(want.input); };
    if (std::all_of(want.clips.begin(), want.clips.end(), is_whole)) want.clips.clear();
}

}  // namespace edgewise
