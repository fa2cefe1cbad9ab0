#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <memory_resource>

#include "graph/transition.hpp"

/// Volumes on a screen, for tests of edges that lead from one to the other.
namespace edgewise::looking {

using Eigen::Matrix3d;

inline Matrix3d turn(double degrees, const Vec3& about) {
    return Eigen::AngleAxisd(degrees * EIGEN_PI / 180, about.normalized()).matrix();
}

/// A volume of some spacing about the middle of a screen.
/// @param zoom  pixels a unit
inline Request seen(Mode mode, const Extent& input, const Extent& screen, const Matrix3d& by,
                    const Vec3& spacing = Vec3::Ones(), double zoom = 1) {
    Request want;
    want.job = Job::render;
    want.mode = mode;
    want.input = input;
    want.spacing = spacing;
    want.screen = screen;
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() =
        Vec3(zoom, zoom, 1).asDiagonal() * by * Matrix3d(spacing.asDiagonal());
    for (int row = 0; row < 3; ++row) {
        map(row, 3) = double(screen[row] - 1) / 2;
        for (int k = 0; k < 3; ++k) map(row, 3) -= map(row, k) * double(input[k] - 1) / 2;
    }
    want.views = Placement(map);
    return want;
}

template <class Value>
Data volume(const Extent& n, Value&& value) {
    Representation what;
    what.extent = n;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x)
                *data.at<float>(x, y, z) = static_cast<float>(value(x, y, z));
    return data;
}

/// Between 0 and 1; a step along x changes it by at most 0.1, along y by 0.085, along z by 0.17.
inline double wave(double x, double y, double z) {
    return 0.5 + 0.5 * std::sin(0.2 * x) * std::cos(0.17 * (y + 2 * z));
}

/// The trilinear field at a point, its outermost samples continued.
inline double trilinear(const Data& data, const Vec3& at) {
    const Extent& n = data.what.extent;
    double sum = 0;
    std::int64_t cell[3];
    double part[3];
    for (int axis = 0; axis < 3; ++axis) {
        const double p = std::clamp(at[axis], 0.0, double(n[axis] - 1));
        cell[axis] =
            std::clamp<std::int64_t>(std::int64_t(p), 0, std::max<std::int64_t>(0, n[axis] - 2));
        part[axis] = p - double(cell[axis]);
    }
    for (int corner = 0; corner < 8; ++corner) {
        double weight = 1;
        std::int64_t i[3];
        for (int axis = 0; axis < 3; ++axis) {
            const bool next = corner >> axis & 1;
            weight *= next ? part[axis] : 1 - part[axis];
            i[axis] = std::min(cell[axis] + next, n[axis] - 1);
        }
        if (weight != 0) sum += weight * double(*data.at<float>(i[0], i[1], i[2]));
    }
    return sum;
}

inline Data made(const Transition& edge, const Data& in, const Ask& ask, const Region& region,
                 const Parameters& with = {}) {
    const Offer offer = edge.offer(in.what, ask, with);
    EXPECT_EQ(offer.refused, "");
    Data out = Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, region, context);
    return out;
}

inline Data made(const Transition& edge, const Data& in, const Ask& ask,
                 const Parameters& with = {}) {
    return made(edge, in, ask, Region::all(ask.want.output()), with);
}

}  // namespace edgewise::looking
