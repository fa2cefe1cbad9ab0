#include "reference/label_light.hpp"

#include <cmath>

#include "graph/label_surface.hpp"
#include "reference/stored.hpp"

namespace edgewise {
namespace {

/// The cubic B-spline and its slope.
double bspline(double x) {
    const double a = std::abs(x);
    if (a >= 2) return 0;
    return a < 1 ? (4 - 6 * a * a + 3 * a * a * a) / 6 : std::pow(2 - a, 3) / 6;
}
double bspline_slope(double x) {
    const double a = std::abs(x), sign = x < 0 ? -1 : 1;
    if (a >= 2) return 0;
    return sign * (a < 1 ? (3 * a - 4) * a / 2 : -(2 - a) * (2 - a) / 2);
}

}  // namespace

Vec3 coverage_gradient(const ReferenceField& field, double label, const Vec3& p) {
    const Extent& n = field.extent();
    constexpr std::int64_t kReach = 2 * kCoverageWidth;
    Vec3 gradient = Vec3::Zero();
    std::int64_t first[3];
    for (int axis = 0; axis < 3; ++axis)
        first[axis] = static_cast<std::int64_t>(std::ceil(p[axis])) - kReach;
    for (std::int64_t z = first[2]; z < first[2] + 2 * kReach; ++z)
        for (std::int64_t y = first[1]; y < first[1] + 2 * kReach; ++y)
            for (std::int64_t x = first[0]; x < first[0] + 2 * kReach; ++x) {
                if (x < 0 || y < 0 || z < 0 || x >= n.x || y >= n.y || z >= n.z) continue;
                if (value_at(field.samples(), x + n.x * (y + n.y * z)) != label) continue;
                const Vec3 place(static_cast<double>(x), static_cast<double>(y),
                                 static_cast<double>(z));
                const Vec3 away = (p - place) / kCoverageWidth;
                for (int axis = 0; axis < 3; ++axis)
                    gradient[axis] += bspline_slope(away[axis]) * bspline(away[(axis + 1) % 3]) *
                                      bspline(away[(axis + 2) % 3]);
            }
    return gradient;
}

Lit label_light(const ReferenceField& field, double label, const RaySpan& ray, double t,
                const LitFrame& frame, const Request& want) {
    const Vec3 p = ray.origin + t * ray.direction;
    if (t > ray.low || on_face(field.extent(), p))
        return frame.at(coverage_gradient(field, label, p), t, want);
    Lit lit = want.shading.at(frame.to_eye, frame.to_eye);
    lit.diffuse *= frame.left(t, want);
    lit.specular *= frame.left(t, want);
    return lit;
}

}  // namespace edgewise
