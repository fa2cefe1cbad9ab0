#pragma once

#include <functional>
#include <map>
#include <vector>

#include "reference/field.hpp"
#include "reference/view_geometry.hpp"

namespace edgewise {

/// How much of each light, and of ambient light, arrives at a point of the input, in f64: light's
/// own rays through the trilinear field (a phantom's formula; labels: nearest), half of the
/// smallest spacing apart, and for ambient light such rays in even directions. Written without the
/// grids that it judges.
class ArrivingLight {
 public:
    /// All must stay alive.
    ArrivingLight(const Request& want, const ReferenceField& field);

    /// Whether anything keeps light away.
    bool any() const noexcept { return want_.shading.shadows || want_.shading.occlusion > 0; }
    Arriving at(int view, const Vec3& p) const;

 private:
    /// Optical depth from a point along a direction of the input, as far as t.
    double depth_along(const Vec3& p, const Vec3& direction, double most, const Clip* kept) const;

    const Request& want_;
    const ReferenceField& field_;
    struct View {
        Eigen::Matrix3d to_input;  // from screen space whose axes are equally long
    };
    std::vector<View> views_;
    std::vector<Vec3> around_;  // directions in that space
    double step_;               // [t]
};

/// What arrives along one ray, by t.
using ArrivingAt = std::function<Arriving(double)>;

/// The same along one ray: worked out where it is asked for, at points half of a t apart, and
/// interpolated linearly between them.
class ArrivingAlong {
 public:
    ArrivingAlong(const ArrivingLight& light, const RaySpan& ray, int view)
        : light_(light), ray_(ray), view_(view) {}
    Arriving at(double t);

 private:
    const Arriving& knot(std::int64_t k);

    const ArrivingLight& light_;
    RaySpan ray_;
    int view_;
    std::map<std::int64_t, Arriving> knots_;
};

}  // namespace edgewise
