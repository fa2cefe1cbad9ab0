#include "reference/arriving_light.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "graph/shadow_start.hpp"

namespace edgewise {
namespace {

constexpr double kKnots = 0.5;      // [t]
constexpr double kSmallest = 1e-6;  // less light than that is none
constexpr int kDirections = 64;

}  // namespace

ArrivingLight::ArrivingLight(const Request& want, const ReferenceField& field)
    : want_(want), field_(field) {
    const Vec3 steps(want.pixel[0], want.pixel[1], 1);
    double smallest = 1;
    for (int view = 0; view < want.frames && any(); ++view) {
        const Eigen::Matrix3d to_screen =
            steps.asDiagonal() * want.views.at(view).matrix().topLeftCorner<3, 3>();
        views_.push_back({to_screen.inverse()});
        smallest = std::min(smallest, to_screen.colwise().norm().minCoeff());
    }
    step_ = smallest / 2;
    if (want.shading.occlusion > 0)
        for (int i = 0; i < kDirections; ++i) {
            // Rows of equal area, each a part of a turn further.
            const double z = -1 + (2 * i + 1.0) / kDirections, across = std::sqrt(1 - z * z);
            const double turn = 2 * std::numbers::pi * (std::numbers::phi - 1) * (i + 0.5);
            around_.emplace_back(across * std::cos(turn), across * std::sin(turn), z);
        }
}

double ArrivingLight::depth_along(const Vec3& p, const Vec3& direction, double most,
                                  const Clip* kept) const {
    RaySpan ray{.origin = p, .direction = direction, .low = 0, .high = most};
    if (!(kept ? ray.clip(*kept) : ray.clip(want_.input))) return 0;
    const double length = ray.high - ray.low;
    const auto cells = static_cast<std::int64_t>(std::ceil(length / step_));
    const double piece = length / static_cast<double>(std::max<std::int64_t>(1, cells));
    const double scale = want_.unit / want_.transfer.unit;
    double depth = 0;
    for (std::int64_t k = 0; k < cells; ++k) {
        double value = 0;
        const Vec3 at = p + (ray.low + (static_cast<double>(k) + 0.5) * piece) * direction;
        if (!field_.simple_at(at, value)) continue;
        const double opacity = want_.transfer.at(value)[3];
        if (opacity >= 1) return HUGE_VAL;
        depth -= std::log1p(-opacity) * piece * scale;
        if (depth > -std::log(kSmallest)) return HUGE_VAL;
    }
    return depth;
}

Arriving ArrivingLight::at(int view, const Vec3& p) const {
    Arriving arriving;
    const Eigen::Matrix3d& to_input = views_[static_cast<std::size_t>(view)].to_input;
    const Clip* kept = want_.clip(view);
    if (want_.shading.shadows)
        for (std::size_t i = 0; i < want_.shading.lights.size(); ++i) {
            const Vec3 towards = to_input * want_.shading.lights[i].towards;
            arriving.lights[i] = std::exp(
                -depth_along(p + shadow_start(want_, view) * towards, towards, HUGE_VAL, kept));
        }
    if (want_.shading.occlusion > 0) {
        arriving.ambient = 0;
        for (const Vec3& along : around_)
            arriving.ambient += std::exp(-depth_along(p, to_input * along,
                                                      want_.shading.occlusion / want_.unit, kept)) /
                                kDirections;
    }
    return arriving;
}

const Arriving& ArrivingAlong::knot(std::int64_t k) {
    const auto found = knots_.find(k);
    if (found != knots_.end()) return found->second;
    const double t = std::clamp(static_cast<double>(k) * kKnots, ray_.low, ray_.high);
    return knots_[k] = light_.at(view_, ray_.origin + t * ray_.direction);
}

Arriving ArrivingAlong::at(double t) {
    const double place = t / kKnots, below = std::floor(place), share = place - below;
    const Arriving a = knot(static_cast<std::int64_t>(below));
    if (share == 0) return a;
    const Arriving& b = knot(static_cast<std::int64_t>(below) + 1);
    Arriving between;
    between.ambient = a.ambient + share * (b.ambient - a.ambient);
    for (std::size_t i = 0; i < between.lights.size(); ++i)
        between.lights[i] = a.lights[i] + share * (b.lights[i] - a.lights[i]);
    return between;
}

}  // namespace edgewise
