#include "reference/view_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

#include "graph/errors.hpp"
#include "reference/job_reference.hpp"

namespace edgewise {
namespace {

/// Cuts [span.low, span.high] to where the ray lies between two planes.
void cut(RaySpan& span, int axis, double from, double to) {
    const double o = span.origin[axis], d = span.direction[axis];
    if (d == 0) {
        if (o < from || o > to) span.high = span.low;
        return;
    }
    const double enters = d > 0 ? from : to, leaves = d > 0 ? to : from;
    span.low = std::max(span.low, (enters - o) / d);
    span.high = std::min(span.high, (leaves - o) / d);
}

/// An eighth of the smallest spacing, on the screen and in the input, where content that is drawn
/// smaller lies closer; rounded down to a power of two. [t]
double reference_step(const Vec3& direction, const Request& want) {
    const double samples =
        direction.cwiseProduct(want.spacing).norm() / want.spacing.minCoeff();  // in one t
    constexpr double kRounding = 1e-6;
    const double finer = std::ceil(std::log2(std::max(1.0, samples * (1 - kRounding))));
    return std::ldexp(0.125, -static_cast<int>(std::min(finer, 20.0)));
}

}  // namespace

bool RaySpan::clip(const Extent& input) noexcept {
    for (int axis = 0; axis < 3; ++axis)
        cut(*this, axis, -0.5, static_cast<double>(input[axis]) - 0.5);
    return low < high;
}

bool RaySpan::clip(const Clip& part) noexcept {
    for (int axis = 0; axis < 3; ++axis) cut(*this, axis, part.low[axis], part.high[axis]);
    for (const HalfSpace& plane : part.planes)
        cut_by_plane(plane.at(origin), plane.normal.dot(direction), low, high);
    for (const Ball& ball : part.balls) {
        const Vec3 from = ball.from_centre(origin), along = ball.to_unit * direction;
        cut_by_ball({from[0], from[1], from[2]}, {along[0], along[1], along[2]}, low, high);
    }
    return low < high;
}

ViewGeometry::ViewGeometry(const Request& want) : want_(want) {
    if (!has_reference(want.job))
        throw RequestError(fmt::format(
            "no reference knows what a {} should give; it cannot be verified", name_of(want.job)));
    if (want.job->of_rays() && want.deformed())
        throw RequestError(fmt::format("the view '{}' bends rays; pictures are of straight ones",
                                       want.views.at(*want.deformed()).name()));
    for (int view = 0; view < want.frames; ++view) {
        to_input_.push_back(want.views.at(view).inverse());
        nearest_.push_back(want.cue ? nearest_corner(want, view) : 0);
    }
}

std::optional<Vec3> ViewGeometry::point(const OutputSample& at) const {
    const Vec3 p = to_input_[at.view].apply(
        Vec3(static_cast<double>(at.x), static_cast<double>(at.y), static_cast<double>(at.z)));
    if (!p.allFinite()) return {};
    return p;
}

std::optional<RaySpan> ViewGeometry::ray(int view, double x, double y) const {
    const Mat4& map = to_input_[view].matrix();
    const auto linear = map.topLeftCorner<3, 3>();
    constexpr double kFar = std::numeric_limits<double>::infinity();
    RaySpan span;
    if (want_.eye) {
        const Eye& eye = *want_.eye;
        const Vec3 along = Vec3(x, y, eye.plane) - eye.at;
        const double length = std::hypot(along.x() * eye.width, along.y() * eye.height, along.z());
        span.origin = linear * eye.at + map.topRightCorner<3, 1>();
        span.direction = linear * along / length;
        span.low = 0;
    } else {
        span.origin = linear * Vec3(x, y, 0) + map.topRightCorner<3, 1>();
        span.direction = linear.col(2);
        span.low = -kFar;
    }
    span.high = kFar;
    const Clip* part = want_.clip(view);
    if (!(part ? span.clip(*part) : span.clip(want_.input))) return {};
    span.step = reference_step(span.direction, want_);
    if (want_.mode->sampled_every > 0) {
        span.step = want_.mode->sampled_every;
        span.front = want_.eye ? 0 : -0.5;
    }
    return span;
}

bool needs_frame(const Request& want) noexcept {
    return want.shading.on() || want.cue || want.mode->first_hit || want.transfer.needs_gradients();
}

LitFrame ViewGeometry::frame(const OutputSample& at) const {
    const Mat4& map = to_input_[at.view].matrix();
    const Vec3 steps(want_.pixel[0], want_.pixel[1], 1);
    LitFrame frame{steps.cwiseInverse().asDiagonal() * map.topLeftCorner<3, 3>().transpose(),
                   Vec3(0, 0, -1)};
    frame.per_length = want_.spacing.cwiseInverse();
    frame.near = -nearest_[static_cast<std::size_t>(at.view)] * want_.unit;
    frame.deeper = want_.unit;
    if (want_.eye) {
        const Vec3 pixel(static_cast<double>(at.x), static_cast<double>(at.y), want_.eye->plane);
        frame.to_eye = (want_.eye->at - pixel).cwiseProduct(steps).normalized();
        frame.near += want_.eye->at.z() * want_.unit;
        frame.deeper *= -frame.to_eye.z();
    }
    return frame;
}

}  // namespace edgewise
