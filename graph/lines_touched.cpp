#include "graph/lines_touched.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "graph/cost.hpp"

namespace edgewise {

namespace {

/// Box around a cache line: places of a sample's first tap from which it reads the line.
struct LineBox {
    double line;                   // [voxels]
    Eigen::Vector3d sides, faces;  // [voxels], [voxels^2]; each face across the axis of its name

    LineBox(double bytes, const Eigen::Vector3d& taps)
        : line(kLineBytes / bytes),
          sides(line - 1 + taps.x(), taps.y(), taps.z()),
          faces(sides.y() * sides.z(), sides.z() * sides.x(), sides.x() * sides.y()) {}
};

}  // namespace

double lines_touched(const Eigen::Matrix3d& lattice, double bytes, const Eigen::Vector3d& taps) {
    const LineBox box(bytes, taps);
    double swept = std::min(box.sides.prod(), std::abs(lattice.determinant()));
    for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d side = lattice.col(k), next = lattice.col((k + 1) % 3);
        swept = std::min(
            {swept, side.cwiseAbs().dot(box.faces), side.cross(next).cwiseAbs().dot(box.sides)});
    }
    return swept / box.line;
}

double lines_swept(const Eigen::Matrix3d& lattice, int side, double bytes,
                   const Eigen::Vector3d& taps) {
    const LineBox box(bytes, taps);
    const Eigen::Vector3d right = side * lattice.col(0), down = side * lattice.col(1),
                          along = lattice.col(2);
    // The shadow along the rows of the box with the parallelogram added to it.
    const double swept =
        std::abs(right.cross(down).dot(along)) + right.cross(along).cwiseAbs().dot(box.sides) +
        down.cross(along).cwiseAbs().dot(box.sides) + along.cwiseAbs().dot(box.faces);
    return swept / box.line / (side * side);
}

}  // namespace edgewise
