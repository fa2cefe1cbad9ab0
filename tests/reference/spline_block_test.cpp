#include "reference/spline_block.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <memory_resource>
#include <random>

namespace edgewise {
namespace {

/// Of numbers drawn at random.
Data drawn(Extent extent) {
    Representation what;
    what.extent = extent;
    what.axes = extent.z > 1 ? 3 : 2;
    Data data = Data::make(what, std::pmr::get_default_resource());
    std::mt19937 bits(7);
    for (std::int64_t i = 0; i < extent.samples(); ++i)
        data.as<float>()[i] = static_cast<float>(bits() % 1000);
    return data;
}

TEST(SplineBlock, GradientsAreDifferencesOfItsValues) {
    constexpr double kAway = 1e-4;
    for (const Extent extent : {Extent{9, 7, 8}, Extent{12, 10, 1}, Extent{1, 6, 5}}) {
        const Data data = drawn(extent);
        const SplineBlock<double> block(data, Region::all(extent), 24,
                                        std::pmr::get_default_resource());
        std::mt19937 bits(3);
        for (int i = 0; i < 200; ++i) {
            Vec3 p;
            for (int axis = 0; axis < 3; ++axis) {
                const double last = static_cast<double>(extent[axis] - 1);
                p[axis] = last * static_cast<double>(bits() % 1000) / 999;
                // So that a difference on both sides stays inside.
                if (last > 0) p[axis] = std::clamp(p[axis], kAway, last - kAway);
            }
            const Vec3 gradient = block.gradient(p);
            for (int axis = 0; axis < 3; ++axis) {
                double below = 0, above = 0;
                if (extent[axis] > 1) {
                    block.at(p - kAway * Vec3::Unit(axis), &below);
                    block.at(p + kAway * Vec3::Unit(axis), &above);
                }
                // A difference of a cubic errs by h^2 / 6 of its third derivative. That is at most
                // 8 times the largest coefficient: 3 times the samples' range along each axis.
                EXPECT_NEAR(gradient[axis], (above - below) / (2 * kAway), 4e-4) << p.transpose();
            }
        }
    }
}

TEST(SplineBlock, GradientsAtFacesAreThoseOfAMirror) {
    const Data data = drawn({9, 7, 8});
    const SplineBlock<double> block(data, Region::all({9, 7, 8}), 24,
                                    std::pmr::get_default_resource());
    for (int axis = 0; axis < 3; ++axis)
        for (const bool last : {false, true}) {
            Vec3 p(3.3, 2.6, 4.1);
            p[axis] = last ? static_cast<double>(Extent{9, 7, 8}[axis] - 1) : 0;
            EXPECT_NEAR(block.gradient(p)[axis], 0, 1e-9) << axis << last;
        }
}

}  // namespace
}  // namespace edgewise
