#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "graph/transform.hpp"
#include "surface/mesh.hpp"

namespace edgewise::surface {

/// From indices to where samples lie.
struct Frame {
    explicit Frame(const Mat4& to_file)
        : origin(to_file.topRightCorner<3, 1>()),
          steps(to_file.topLeftCorner<3, 3>()),
          gradients(steps.inverse().transpose().cast<float>()),
          mirrored(steps.determinant() < 0) {}

    Eigen::Vector3d origin;
    Eigen::Matrix3d steps;      // columns: from one sample to the next
    Eigen::Matrix3f gradients;  // from differences along the axes to the gradient
    bool mirrored;              // what goes clockwise among indices goes counter-clockwise here

    Eigen::Vector3d at(const Eigen::Vector3d& index) const { return origin + steps * index; }
};

inline Float3 float3(const Eigen::Vector3d& v) noexcept {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace edgewise::surface
