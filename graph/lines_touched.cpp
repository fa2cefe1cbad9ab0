#include "graph/lines_touched.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "graph/cost.hpp"

namespace edgewise {

double lines_touched(const Eigen::Matrix3d& lattice, double bytes, const Eigen::Vector3d& taps) {
    const double line = kLineBytes / bytes;  // [voxels]
    const Eigen::Vector3d box(line - 1 + taps.x(), taps.y(), taps.z());
    const Eigen::Vector3d faces(box.y() * box.z(), box.z() * box.x(), box.x() * box.y());
    double swept = std::min(box.prod(), std::abs(lattice.determinant()));
    for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d side = lattice.col(k), next = lattice.col((k + 1) % 3);
        swept = std::min({swept, side.cwiseAbs().dot(faces), side.cross(next).cwiseAbs().dot(box)});
    }
    return swept / line;
}

double lines_swept(const Eigen::Matrix3d& lattice, int side, double bytes,
                   const Eigen::Vector3d& taps) {
    const double line = kLineBytes / bytes;  // [voxels]
    const Eigen::Vector3d right = side * lattice.col(0), down = side * lattice.col(1),
                          along = lattice.col(2);
    const Eigen::Vector3d box(line - 1 + taps.x(), taps.y(), taps.z());
    const Eigen::Vector3d faces(box.y() * box.z(), box.z() * box.x(), box.x() * box.y());
    // The shadow along the rows of the box with the parallelogram added to it.
    const double swept = std::abs(right.cross(down).dot(along)) +
                         right.cross(along).cwiseAbs().dot(box) +
                         down.cross(along).cwiseAbs().dot(box) + along.cwiseAbs().dot(faces);
    return swept / line / (side * side);
}

}  // namespace edgewise
