#include "graph/spread.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

namespace edgewise {
namespace {

Mat4 turned(int axis, double degrees, double centre) {
    Eigen::Affine3d map = Eigen::Affine3d::Identity();
    map.translate(Vec3::Constant(centre));
    map.rotate(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3::Unit(axis)));
    map.translate(Vec3::Constant(-centre));
    return map.matrix();
}

TEST(Spread, CutsAsEvenlyAsTheFactorsAllow) {
    const Extent cube{128, 128, 128};
    EXPECT_EQ(cut_of(Layout::columns, cube, 3, 1024), (Cut{32, 32, 1}));
    EXPECT_EQ(cut_of(Layout::diced, cube, 3, 1024), (Cut{16, 8, 8}));  // 3.8: 2^4 2^3 2^3
    EXPECT_EQ(cut_of(Layout::diced, cube, 3, 4096), (Cut{16, 16, 16}));
    EXPECT_EQ(cut_of(Layout::columns, cube, 3, 12), (Cut{3, 4, 1}));
    EXPECT_EQ(cut_of(Layout::diced, {1000, 10, 10}, 3, 8), (Cut{8, 1, 1}));
    EXPECT_EQ(cut_of(Layout::diced, {64, 64, 1}, 2, 16), (Cut{4, 4, 1}));
    EXPECT_EQ(cut_of(Layout::linear, cube, 3, 16), (Cut{1, 1, 1}));
    for (int ranks = 1; ranks <= 100; ++ranks) {
        const Cut cut = cut_of(Layout::diced, cube, 3, ranks);
        EXPECT_EQ(cut[0] * cut[1] * cut[2], ranks);
    }
}

TEST(Spread, WhatStaysIsSeenAndDoesNotMeet) {
    const Extent cube{64, 64, 64};
    for (const Layout layout : {Layout::columns, Layout::diced}) {
        const Moves moves = moves_of(Mat4::Identity(), cube, cube, 3, layout, 64);
        EXPECT_EQ(moves.seen, 1);
        EXPECT_EQ(moves.meet, 1);
    }
}

TEST(Spread, ShareThatIsSeenIsThatOfAllSamples) {
    const int side = 32;
    const Extent cube{side, side, side};
    const Mat4 map = turned(1, 30, 0.5 * (side - 1));
    double seen = 0;
    for (int z = 0; z < side; ++z)
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) {
                const Eigen::Vector4d q = map * Eigen::Vector4d(x, y, z, 1);
                bool inside = true;
                for (int axis = 0; axis < 3; ++axis)
                    inside = inside && q[axis] >= -0.5 && q[axis] <= side - 0.5;
                seen += inside;
            }
    // A lattice of 512 samples: three standard deviations of a share are below 0.07.
    EXPECT_NEAR(moves_of(map, cube, cube, 3, Layout::diced, 8).seen, seen / (side * side * side),
                0.07);
}

TEST(Spread, PlanesOfColumnsAreSqueezedByTheCosine) {
    const Extent cube{128, 128, 128};
    for (const double degrees : {20.0, 60.0, 80.0}) {
        const double expected = 1 / std::cos(degrees * std::numbers::pi / 180);
        EXPECT_NEAR(moves_of(turned(0, degrees, 63.5), cube, cube, 3, Layout::columns, 16384).meet,
                    expected, 1e-9);
        EXPECT_NEAR(moves_of(turned(2, degrees, 63.5), cube, cube, 3, Layout::columns, 16384).meet,
                    1, 1e-9);
        EXPECT_EQ(moves_of(turned(0, degrees, 63.5), cube, cube, 3, Layout::diced, 16384).meet, 1);
    }
    // A plane that is seen from its edge still reaches a line of ports.
    EXPECT_EQ(moves_of(turned(0, 90, 63.5), cube, cube, 3, Layout::columns, 16384).meet, 32);
}

TEST(Spread, HaloIsTheShellOfABox) {
    EXPECT_EQ(halo_samples({64, 64, 64}, {2, 2, 2}, 1), 34 * 34 * 34 - 32 * 32 * 32);
    EXPECT_EQ(halo_samples({64, 64, 64}, {1, 1, 1}, 1), 0);
    EXPECT_EQ(halo_samples({64, 64, 64}, {4, 1, 1}, 2), (20 - 16) * 64 * 64);
}

}  // namespace
}  // namespace edgewise
