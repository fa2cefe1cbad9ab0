#include "graph/clip.hpp"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace edgewise {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Extent kInput{10, 8, 6};

HalfSpace plane(const Vec3& normal, double offset) {
    return {normal.normalized(), offset / normal.norm()};
}

TEST(Clip, OfNoPlanesKeepsAll) {
    const Clip clip = clip_of(kInput, {});
    EXPECT_TRUE(clip.keeps_all(kInput));
    EXPECT_EQ(clip.volume, 480);
    EXPECT_EQ(clip.least, Vec3::Constant(-0.5));
    EXPECT_EQ(clip.most, Vec3(9.5, 7.5, 5.5));
}

TEST(Clip, PlanesAlongAxesAreFacesOfABox) {
    const std::vector<HalfSpace> planes{
        {Vec3::UnitX(), -2}, {-Vec3::UnitY(), 5}, {Vec3::UnitZ(), 9}};
    const Clip clip = clip_of(kInput, planes);
    EXPECT_TRUE(clip.planes.empty());
    EXPECT_EQ(clip.low, Vec3(2, -0.5, -0.5));
    EXPECT_EQ(clip.high, Vec3(9.5, 5, 5.5));
    EXPECT_EQ(clip.volume, 7.5 * 5.5 * 6);
    const Clip again = clip_of(kInput, half_spaces_of(clip));
    EXPECT_EQ(again.low, clip.low);
    EXPECT_EQ(again.high, clip.high);
}

TEST(Clip, PlanesThatKeepTheWholeBoxAreLeftOut) {
    const std::vector<HalfSpace> planes{plane({1, 1, 1}, 1.5), plane({-1, 2, 0.5}, 100)};
    EXPECT_TRUE(clip_of(kInput, planes).keeps_all(kInput));
}

TEST(Clip, ACornerIsATetrahedron) {
    // x + y + z <= 1.5 from the corner at (-0.5, -0.5, -0.5): legs of 3.
    const std::vector<HalfSpace> planes{plane({-1, -1, -1}, 1.5)};
    const Clip clip = clip_of(kInput, planes);
    ASSERT_EQ(clip.planes.size(), 1u);
    EXPECT_NEAR(clip.volume, 27.0 / 6, 1e-12);
    EXPECT_TRUE(clip.least.isApprox(Vec3::Constant(-0.5)));
    EXPECT_TRUE(clip.most.isApprox(Vec3::Constant(2.5)));
}

TEST(Clip, WhatIsOutsideOrOnlyTouchedIsEmpty) {
    for (const HalfSpace& one : {plane({1, 1, 0}, -20), plane({-1, -1, -1}, -1.5),
                                 HalfSpace{Vec3::UnitX(), -9.5}, HalfSpace{Vec3::UnitX(), -30}}) {
        const std::vector<HalfSpace> planes{one};
        EXPECT_EQ(clip_of(kInput, planes).volume, 0) << one.normal.transpose();
    }
    const std::vector<HalfSpace> apart{plane({1, 1, 1}, -10), plane({-1, -1, -1}, 9)};
    EXPECT_EQ(clip_of(kInput, apart).volume, 0);
}

Ball ball(const Vec3& centre, double radius, const Vec3& spacing = Vec3::Ones()) {
    return {centre, Eigen::Matrix3d(spacing.asDiagonal()) / radius};
}

TEST(Clip, ABallHasItsVolumeAndItsBox) {
    const std::vector<Ball> one{ball({4, 3, 2.5}, 2)};
    const Clip clip = clip_of(kInput, {}, one);
    ASSERT_EQ(clip.balls.size(), 1u);
    EXPECT_FALSE(clip.keeps_all(kInput));
    // 64 x 64 lines: about a thousandth.
    EXPECT_NEAR(clip.volume / (4.0 / 3 * EIGEN_PI * 8), 1, 2e-3);
    EXPECT_TRUE(clip.least.isApprox(Vec3(2, 1, 0.5)));
    EXPECT_TRUE(clip.most.isApprox(Vec3(6, 5, 4.5)));
    // In a file whose samples are half a unit apart along x.
    const std::vector<Ball> oblong{ball({4, 3, 2.5}, 2, {0.5, 1, 2})};
    const Clip other = clip_of(kInput, {}, oblong);
    EXPECT_TRUE(other.least.isApprox(Vec3(0, 1, 1.5)));
    EXPECT_TRUE(other.most.isApprox(Vec3(8, 5, 3.5)));
    EXPECT_NEAR(other.volume / clip.volume, 1, 4e-3);
}

TEST(Clip, ABallThatKeepsTheWholeBoxIsLeftOut) {
    const std::vector<Ball> large{ball({4, 3, 2}, 10), ball({0, 0, 0}, 1e300)};
    EXPECT_TRUE(clip_of(kInput, {}, large).keeps_all(kInput));
}

TEST(Clip, BallsApartKeepNothing) {
    for (const std::vector<Ball>& balls :
         {std::vector<Ball>{ball({30, 3, 2}, 4)}, std::vector<Ball>{ball({-4.5, 3, 2}, 4)},
          std::vector<Ball>{ball({2, 2, 2}, 1), ball({4.1, 2, 2}, 1)},
          std::vector<Ball>{ball({12, 9.9, 7}, 3)}, std::vector<Ball>{ball({1e300, 0, 0}, 2)},
          std::vector<Ball>{ball({1e300, 0, 0}, 1e299)}})
        EXPECT_EQ(clip_of(kInput, {}, balls).volume, 0);
    // A plane that passes by, and one that leaves a cap.
    const std::vector<Ball> one{ball({4, 3, 2}, 1)};
    const std::vector<HalfSpace> by{plane({1, 1, 0}, -7 - 1.42)}, cap{plane({1, 1, 0}, -7 - 0.7)};
    EXPECT_EQ(clip_of(kInput, by, one).volume, 0);
    const double height = 1 - 0.7 / std::sqrt(2);
    EXPECT_NEAR(clip_of(kInput, cap, one).volume, EIGEN_PI * height * height * (3 - height) / 3,
                2e-3 * 4);
    // Thin, but something.
    const std::vector<Ball> thin{ball({2, 2, 2}, 1), ball({3.99999, 2, 2}, 1)};
    EXPECT_GT(clip_of(kInput, {}, thin).volume, 0);
}

TEST(Clip, LinesAreCutToABall) {
    const auto cut = [](std::array<double, 3> from, std::array<double, 3> along, double low = -99,
                        double high = 99) {
        cut_by_ball(from, along, low, high);
        return std::array{low, high};
    };
    EXPECT_EQ(cut({0, 0, -5}, {0, 0, 1}), (std::array{4.0, 6.0}));
    EXPECT_EQ(cut({0, 0, -5}, {0, 0, 1}, 5, 99), (std::array{5.0, 6.0}));
    EXPECT_EQ(cut({0, 1, 0}, {0, 0, 1}), (std::array{-99.0, -99.0}));  // touches it
    EXPECT_EQ(cut({0, 2, 0}, {0, 0, 1}), (std::array{-99.0, -99.0}));
    // From far away: the nearest place is known to 1e9 x 2^-52.
    const auto [low, high] = cut({0.6, 0, -1e9}, {0, 0, 1}, -kInfinity, kInfinity);
    EXPECT_NEAR(high - low, 1.6, 1e-6);
    EXPECT_NEAR(0.5 * (low + high), 1e9, 1e-6);
}

TEST(Clip, VolumesAndBoundsAreThoseOfPointsCounted) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> part(-1, 1), share(0, 1);
    for (int round = 0; round < 20; ++round) {
        std::vector<HalfSpace> planes;
        for (int i = 0; i < 1 + round % 4; ++i)
            planes.push_back(plane({part(random), part(random), part(random)}, 0));
        for (HalfSpace& one : planes) one.offset = 1 - one.normal.dot(Vec3(4.5, 3.5, 2.5));
        const Clip clip = clip_of(kInput, planes);
        constexpr int kPoints = 40000;
        int inside = 0;
        Vec3 least = Vec3::Constant(kInfinity), most = -least;
        for (int i = 0; i < kPoints; ++i) {
            const Vec3 p(10 * share(random) - 0.5, 8 * share(random) - 0.5,
                         6 * share(random) - 0.5);
            bool kept = true;
            for (const HalfSpace& one : planes) kept = kept && one.at(p) >= 0;
            if (!kept) continue;
            ++inside;
            least = least.cwiseMin(p), most = most.cwiseMax(p);
        }
        // Four standard deviations of a share of 1/2.
        EXPECT_NEAR(clip.volume / 480, double(inside) / kPoints, 4 * 0.5 / std::sqrt(kPoints));
        EXPECT_TRUE(((least - clip.least).array() >= -1e-12).all()) << round;
        EXPECT_TRUE(((clip.most - most).array() >= -1e-12).all()) << round;
        EXPECT_TRUE(((least - clip.least).array() < 1.5).all()) << round;
    }
}

TEST(Clip, CutsLinesAsHalfSpacesSay) {
    const auto cut = [](double base, double slope) {
        double low = -4, high = 4;
        cut_by_plane(base, slope, low, high);
        return std::pair(low, high);
    };
    EXPECT_EQ(cut(1, 1), std::pair(-1.0, 4.0));
    EXPECT_EQ(cut(1, -1), std::pair(-4.0, 1.0));
    EXPECT_EQ(cut(1, 0.1), std::pair(-4.0, 4.0));
    EXPECT_EQ(cut(1, 0), std::pair(-4.0, 4.0));
    EXPECT_EQ(cut(-1e-12, 1e-16), std::pair(-4.0, 4.0)) << "in the plane, but for rounding";
    const auto [low, high] = cut(-1, 0);
    EXPECT_FALSE(low < high);
}

}  // namespace
}  // namespace edgewise
