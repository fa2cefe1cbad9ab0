#include "graph/clip.hpp"

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
