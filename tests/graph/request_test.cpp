#include "graph/request.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gtest/gtest.h>
#include <random>

namespace edgewise {
namespace {

Mat4 turned(double angle, double shift) {
    Eigen::Affine3d map = Eigen::Translation3d(shift, -shift, 1) *
                          Eigen::AngleAxisd(angle, Vec3(1, 2, 3).normalized());
    return map.matrix();
}

TEST(Residual, IsWhatIsStillToBeDone) {
    Request want;
    want.frames = 3;
    want.views = Placement::each({turned(0.1, 4), turned(0.2, 5), turned(0.3, 6)});
    Representation half_way;
    half_way.placed = turned(1.5, -2);
    for (int view = 0; view < 3; ++view) {
        // Going half way and then the rest is the view.
        const Mat4 both = residual(half_way, want, view) * half_way.placed.at(view).matrix();
        EXPECT_LT((both - want.views.at(view).matrix()).cwiseAbs().maxCoeff(), 1e-14);
        EXPECT_EQ(residual(Representation(), want, view), want.views.at(view).matrix());  // exact
    }
    Representation there;
    there.placed = want.views;
    for (int view = 0; view < 3; ++view)
        EXPECT_LT((residual(there, want, view) - Mat4::Identity()).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(Screen, TargetsFollowTheJob) {
    Request want;
    want.screen = {7, 5, 3};
    Representation from;
    from.type = Type::u8;
    from.values = {2, 1};
    from.facets = {"minmax"};
    want.job = Job::warp;
    const Representation samples = screen_scalar(from, want);
    EXPECT_EQ(samples.text(), "screen/scalar/f32/linear/7x5x3");
    EXPECT_TRUE(samples.values.identity());
    EXPECT_TRUE(is_target(samples, want));
    want.job = Job::render;
    EXPECT_FALSE(is_target(samples, want));
    for (const auto& [mode, channels] :
         {std::pair{Mode::mip, 1}, {Mode::xray, 1}, {Mode::mean, 1}, {Mode::composite, 4}}) {
        want.mode = mode;
        const Representation picture = screen_picture(from, want);
        EXPECT_EQ(picture.extent, (Extent{7, 5, 1}));
        EXPECT_EQ(picture.axes, 2);
        EXPECT_EQ(picture.channels, channels);
        EXPECT_TRUE(is_target(picture, want));
    }
    Representation away = screen_picture(from, want);
    away.place = Place::ranks;
    EXPECT_FALSE(is_target(away, want));
}

TEST(Request, ProjectiveWhereSomeViewIs) {
    Request want;
    want.frames = 2;
    EXPECT_FALSE(want.projective());
    Mat4 tilted = Mat4::Identity();
    tilted(3, 0) = 1e-3;
    want.views = Placement::each({Mat4(Mat4::Identity()), tilted});
    EXPECT_TRUE(want.projective());
}

TEST(Transfer, IsLinearBetweenPointsAndConstantBeyond) {
    const Transfer transfer{.points = {{10, 0.0, {0, 0, 0}},
                                       {20, 0.5, {1, 0.5, 0}},
                                       {20, 0.75, {0, 0, 1}},
                                       {30, 1, {1, 1, 1}}},
                            .unit = 1};
    EXPECT_EQ(transfer.at(-100), (std::array<double, 4>{0, 0, 0, 0}));
    EXPECT_EQ(transfer.at(10), (std::array<double, 4>{0, 0, 0, 0}));
    EXPECT_EQ(transfer.at(15), (std::array<double, 4>{0.5, 0.25, 0, 0.25}));
    EXPECT_EQ(transfer.at(20)[3], 0.75);  // a step: from its value on the later point counts
    EXPECT_EQ(transfer.at(25), (std::array<double, 4>{0.5, 0.5, 1, 0.875}));
    EXPECT_EQ(transfer.at(1e9), (std::array<double, 4>{1, 1, 1, 1}));
    const Transfer one{.points = {{5, 0.25, {1, 0, 0}}}};
    for (const double value : {0.0, 5.0, 9.0})
        EXPECT_EQ(one.at(value), (std::array<double, 4>{1, 0, 0, 0.25}));
}

TEST(Names, AreThoseOfTheCommandLine) {
    EXPECT_EQ(name_of(Job::warp), "warp");
    EXPECT_EQ(name_of(Job::render), "render");
    EXPECT_EQ(name_of(Mode::composite), "composite");
    EXPECT_EQ(name_of(Minimize::memory), "memory");
}

}  // namespace
}  // namespace edgewise
