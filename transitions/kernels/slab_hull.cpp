#include "transitions/kernels/slab_hull.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "transitions/kernels/ray_path.hpp"

namespace edgewise::kernels {

SlabHull::SlabHull() noexcept {
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
}

void SlabHull::add(const std::array<double, 3>& least, const std::array<double, 3>& most) noexcept {
    for (std::size_t i = 0; i < kSlabs; ++i) {
        double from = 0, to = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const int n = kNormal[i][axis];
            from += n * (n > 0 ? least : most)[axis];
            to += n * (n > 0 ? most : least)[axis];
        }
        low[i] = std::min(low[i], from);
        high[i] = std::max(high[i], to);
    }
}

SlabHull hull_of(const Bricks& bricks, const Extent& volume, float bound, bool above) {
    constexpr std::int64_t kWide = 1 << Bricks::kShift;
    SlabHull hull;
    const Extent& n = bricks.extent;
    const auto counts = [&](float level) { return above ? level > bound : level >= bound; };
    // Places of brick i begin at sample i kWide; outermost bricks reach the faces.
    const auto face = [&](std::int64_t i, int axis) {
        return i == 0         ? -0.5
               : i == n[axis] ? static_cast<double>(volume[axis]) - 0.5
                              : static_cast<double>(i * kWide);
    };
    for (std::int64_t k = 0; k < n.z; ++k)
        for (std::int64_t j = 0; j < n.y; ++j) {
            const float* row = bricks.level.data() + (k * n.y + j) * n.x;
            const float* const first = std::find_if(row, row + n.x, counts);
            if (first == row + n.x) continue;
            // Of a line of bricks the outermost two say all.
            std::int64_t last = n.x - 1;
            while (!counts(row[last])) --last;
            hull.add({face(first - row, 0), face(j, 1), face(k, 2)},
                     {face(last + 1, 0), face(j + 1, 1), face(k + 1, 2)});
        }
    return hull;
}

Kept kept_in(const SlabHull& hull, const RayCast& cast,
             const std::array<double, SlabHull::kSlabs>& wider) {
    Kept kept;
    if (cast.kept) kept = *cast.kept;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        kept.low[axis] = low_face(cast, axis);
        kept.high[axis] = high_face(cast, axis);
    }
    if (hull.empty()) {
        kept.high = {-1, -1, -1};
        kept.low = {0, 0, 0};
        return kept;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        kept.low[axis] = std::max(kept.low[axis], hull.low[axis] - wider[axis]);
        kept.high[axis] = std::min(kept.high[axis], hull.high[axis] + wider[axis]);
    }
    SlabHull box;
    box.add(kept.low, kept.high);
    for (std::size_t i = 3; i < SlabHull::kSlabs; ++i) {
        const std::array<int, 3>& n = SlabHull::kNormal[i];
        const double low = hull.low[i] - wider[i], high = hull.high[i] + wider[i];
        if (low > box.low[i])
            kept.planes.push_back({{double(n[0]), double(n[1]), double(n[2])}, -low});
        if (high < box.high[i])
            kept.planes.push_back({{double(-n[0]), double(-n[1]), double(-n[2])}, high});
    }
    return kept;
}

std::array<double, SlabHull::kSlabs> strides_along_normals(const RayCast& cast) {
    const auto vector = [](const std::array<double, 3>& v) {
        return Eigen::Vector3d(v[0], v[1], v[2]);
    };
    const auto columns = [&](const Rays::Field& field) {
        Eigen::Matrix3d m;
        m << vector(field.base), vector(field.x), vector(field.y);
        return m;
    };
    const ParallelRays shared(cast);
    Eigen::Matrix3d turned = Eigen::Matrix3d::Zero();  // of a ray of length one [unit]
    if (!shared.parallel)
        turned = columns(cast.rays.direction) * columns(cast.rays.measure).inverse();
    std::array<double, SlabHull::kSlabs> most;
    for (std::size_t i = 0; i < SlabHull::kSlabs; ++i) {
        const std::array<int, 3>& n = SlabHull::kNormal[i];
        const Eigen::Vector3d normal(n[0], n[1], n[2]);
        most[i] = shared.parallel ? std::abs(normal.dot(vector(shared.along)))
                                  : (turned.transpose() * normal).norm() * cast.step;
    }
    return most;
}

}  // namespace edgewise::kernels
