#pragma once

#include <array>
#include <cmath>

#include "graph/request.hpp"

namespace edgewise {

// Pictures of labels: each label has a surface of its own in a colour of its own. What is seen is
// the first voxel of a ray that holds a label: a finite value other than the background's. A label
// that reaches the volume's faces is closed there, and one that a clip cuts is closed by the cut.
// Light takes normals from the label's coverage: 1 at its samples, 0 elsewhere and outside,
// smoothed by a cubic B-spline so wide that the steps of voxels are hardly seen. On a clip's cut
// the surface faces the eye.

/// Whether a picture of labels' surfaces is asked for.
inline bool shows_labels(const Request& want) noexcept {
    return want.job->of_rays() && want.mode->first_hit && want.surface && !want.surface->isovalue;
}

/// Whether a value is a label.
inline bool is_label(const Request& want, double value) noexcept {
    return std::isfinite(value) && value != want.outside;
}

/// The colour of a label, by Request::transfer; white where that says nothing.
inline std::array<double, 3> color_of_label(const Request& want, double label) noexcept {
    if (want.transfer.points.empty()) return {1, 1, 1};
    const std::array<double, 4> optics = want.transfer.at(label);
    return {optics[0], optics[1], optics[2]};
}

/// Samples from one knot of that spline to the next. It reaches twice as far.
inline constexpr int kCoverageWidth = 2;

/// A hit that a ray has where it enters is on the volume's face when it is as near as that to one,
/// else on a clip's [sample].
inline constexpr double kOnFace = 1e-6;

inline bool on_face(const Extent& n, const Vec3& p) noexcept {
    for (int axis = 0; axis < 3; ++axis)
        if (std::abs(p[axis] + 0.5) < kOnFace ||
            std::abs(p[axis] - (static_cast<double>(n[axis]) - 0.5)) < kOnFace)
            return true;
    return false;
}

}  // namespace edgewise
