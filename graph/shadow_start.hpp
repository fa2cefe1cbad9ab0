#pragma once

#include "graph/request.hpp"

namespace edgewise {

/// How far from a sample towards a light shadows begin, in samples of the input along the axis
/// where they are closest. Opacity of a surface rises within one or two samples, so a sample of it
/// would lie in its own shadow, more or less as it lies between samples: rings. Who takes samples
/// for clouds has no surface, and the optical depth is whole.
constexpr double kShadowStart = 2;

/// The same as a length of screen space whose axes are equally long [t].
inline double shadow_start(const Request& want, int view) {
    if (!want.shading.has_normals()) return 0;
    Eigen::Matrix3d to_screen = want.views.at(view).matrix().topLeftCorner<3, 3>();
    to_screen.row(0) *= want.pixel[0];
    to_screen.row(1) *= want.pixel[1];
    return kShadowStart * to_screen.colwise().norm().minCoeff();
}

}  // namespace edgewise
