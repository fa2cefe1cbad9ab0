#include "request/clip.hpp"

#include <array>
#include <gtest/gtest.h>
#include <utility>
#include <vector>

#include "graph/errors.hpp"
#include "reference/view_geometry.hpp"

namespace edgewise {
namespace {

/// A request for pictures of a volume, without a clip.
struct Case {
    InputGrid grid;
    GeometrySpec spec;
    Request want;
    Geometry geometry;

    explicit Case(GeometrySpec seen = {}, const Vec3& spacing = Vec3::Ones()) : spec(seen) {
        grid.extent = {20, 16, 12};
        grid.spacing = spacing;
        geometry = geometry_of(spec, grid, Job::render);
        want.job = Job::render;
        want.input = grid.extent;
        want.spacing = grid.spacing;
        want.frames = static_cast<int>(geometry.views.size());
        want.views = Placement::each({geometry.views.begin(), geometry.views.end()});
        want.screen = geometry.grid.extent;
        want.unit = geometry.unit;
        want.eye = geometry.eye;
    }
    const std::vector<Clip>& clipped(const ClipSpec& by) {
        take_clip(want, by, grid, geometry);
        return want.clips;
    }
};

ClipSpec box(const std::array<double, 6>& keeps) {
    ClipSpec by;
    by.box = keeps;
    return by;
}

ClipSpec planes(std::vector<std::array<double, 4>> keep) {
    ClipSpec by;
    by.planes = std::move(keep);
    return by;
}

ClipSpec slab(double thick) {
    ClipSpec by;
    by.slab = thick;
    return by;
}

ClipSpec box_and_plane(const std::array<double, 6>& keeps, const std::array<double, 4>& plane) {
    ClipSpec by = box(keeps);
    by.planes = {plane};
    return by;
}

TEST(TakeClip, ABoxKeepsItsSamplesWithHalfVoxels) {
    Case c;
    const auto& clips = c.clipped(box({3, 4, 5, 10, 4, 100}));
    ASSERT_EQ(clips.size(), 1u);
    EXPECT_EQ(clips[0].low, Vec3(2.5, 3.5, 4.5));
    EXPECT_EQ(clips[0].high, Vec3(10.5, 4.5, 11.5));
}

TEST(TakeClip, PlanesSayTheSameAsABox) {
    Case c;
    const Clip by_box = c.clipped(box({3, 0, 5, 10, 15, 11}))[0];
    const Clip by_planes =
        c.clipped(planes({{2, 0, 0, -5}, {-0.5, 0, 0, 5.25}, {0, 0, 1, -4.5}}))[0];
    EXPECT_EQ(by_planes.low, by_box.low);
    EXPECT_EQ(by_planes.high, by_box.high);
    EXPECT_TRUE(by_planes.planes.empty());
}

TEST(TakeClip, WhatKeepsAllIsNone) {
    Case c;
    EXPECT_TRUE(c.clipped({}).empty());
    EXPECT_TRUE(c.clipped(box({0, 0, 0, 19, 15, 11})).empty());
    EXPECT_TRUE(c.clipped(box_and_plane({-3, -3, -3, 40, 40, 40}, {1, 1, 1, 99})).empty());
    EXPECT_TRUE(c.clipped(slab(12)).empty());
}

TEST(TakeClip, ASlabLiesAboutTheMiddleOfEachView) {
    GeometrySpec spec;
    spec.steps = {{GeometryStep::Kind::rotate, {25, 10, 5}}, {GeometryStep::Kind::turntable, {3}}};
    Case c(spec, {0.5, 0.8, 2});
    const auto& clips = c.clipped(slab(3.5));
    ASSERT_EQ(clips.size(), 3u);
    const ViewGeometry seen(c.want);
    for (int view = 0; view < 3; ++view) {
        const double x = static_cast<double>(c.want.screen.x - 1) / 2,
                     y = static_cast<double>(c.want.screen.y - 1) / 2;
        const auto ray = seen.ray(view, x, y);
        ASSERT_TRUE(ray);
        EXPECT_NEAR((ray->high - ray->low) * c.want.unit, 3.5, 1e-9);
        const Vec3 middle = ray->origin + 0.5 * (ray->low + ray->high) * ray->direction;
        EXPECT_TRUE(middle.isApprox(Vec3(9.5, 7.5, 5.5), 1e-9)) << middle.transpose();
    }
}

TEST(TakeClip, AVolumeMovesThroughTheSlab) {
    GeometrySpec spec;
    spec.view = "z";
    spec.steps = {{GeometryStep::Kind::translate, {0, 0, -4}}};
    Case c(spec);
    const Clip clip = c.clipped(slab(2))[0];
    // Four units nearer to the eye: what lies four slices behind the middle is in the slab.
    EXPECT_EQ(clip.low.z(), 5.5 + 4 - 1);
    EXPECT_EQ(clip.high.z(), 5.5 + 4 + 1);
}

TEST(TakeClip, PerspectiveRaysEndInTheSlab) {
    GeometrySpec spec;
    spec.perspective = 40;
    Case c(spec);
    c.clipped(slab(4));
    const auto ray = ViewGeometry(c.want).ray(0, 3, 3);
    ASSERT_TRUE(ray);
    for (const double t : {ray->low, ray->high})
        EXPECT_NEAR(std::abs((ray->origin + t * ray->direction).z() - 5.5), 2, 1e-9);
}

ClipSpec balls(std::vector<std::array<double, 4>> keep) {
    ClipSpec by;
    by.balls = std::move(keep);
    return by;
}

TEST(TakeClip, ABallsRadiusIsInTheFilesUnit) {
    GeometrySpec spec;
    spec.steps = {{GeometryStep::Kind::rotate, {25, 10, 5}}, {GeometryStep::Kind::turntable, {3}}};
    for (const double perspective : {0.0, 40.0}) {
        GeometrySpec seen = spec;
        if (perspective > 0) seen.perspective = perspective;
        Case c(seen, {0.5, 0.8, 2});
        const auto& clips = c.clipped(balls({{9.5, 7.5, 5.5, 3.5}}));
        ASSERT_EQ(clips.size(), 1u);
        const ViewGeometry rays(c.want);
        for (int view = 0; view < 3; ++view) {
            const double x = static_cast<double>(c.want.screen.x - 1) / 2,
                         y = static_cast<double>(c.want.screen.y - 1) / 2;
            const auto ray = rays.ray(view, x, y);
            ASSERT_TRUE(ray);
            EXPECT_NEAR((ray->high - ray->low) * c.want.unit, 7, 1e-9);
            for (const double t : {ray->low, ray->high}) {
                const Vec3 away = ray->origin + t * ray->direction - Vec3(9.5, 7.5, 5.5);
                EXPECT_NEAR(away.cwiseProduct(c.want.spacing).norm(), 3.5, 1e-9);
            }
        }
    }
}

TEST(TakeClip, ABallIsRoundInAGridThatLeans) {
    Case c;
    c.grid.lean.col(2) = Vec3(0, 0.6, 0.8);
    c.grid.spacing = {1, 1.5, 2};
    const Clip clip = c.clipped(balls({{9.5, 7.5, 5.5, 4}}))[0];
    ASSERT_EQ(clip.balls.size(), 1u);
    for (const Vec3& away : {Vec3(4, 0, 0), Vec3(0, 0, 2), Vec3(1, -0.5, 1)}) {
        const Vec3 there = c.grid.lean * away.cwiseProduct(c.grid.spacing);
        EXPECT_NEAR(clip.balls[0].from_centre(Vec3(9.5, 7.5, 5.5) + away).norm(), there.norm() / 4,
                    1e-12);
    }
}

TEST(TakeClip, BallsAddUpWithAllOthers) {
    Case c;
    ClipSpec by = box_and_plane({3, 0, 0, 19, 15, 11}, {1, 1, 0, -9});
    by.balls = {{9, 8, 6, 5}, {11, 8, 6, 5}, {10, 8, 6, 1000}};
    by.slab = 4;
    const Clip clip = c.clipped(by)[0];
    EXPECT_EQ(clip.balls.size(), 2u);  // the third keeps all
    EXPECT_EQ(clip.planes.size(), 1u);
    EXPECT_EQ(by.settings().text(), "box and planes and balls and slab");
    EXPECT_TRUE(c.clipped(balls({{10, 8, 6, 1000}})).empty());
}

TEST(TakeClip, RefusesWhatMakesNoSense) {
    const auto why = [](const ClipSpec& by) {
        Case c;
        try {
            c.clipped(by);
        } catch (const RequestError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_NE(why(box({0, 0, 0, NAN, 1, 1})).find("box="), std::string::npos);
    EXPECT_NE(why(box({0, 5, 0, 9, 4, 9})).find("Y begins behind its end"), std::string::npos);
    EXPECT_NE(why(box({20, 0, 0, 30, 9, 9})).find("keeps nothing"), std::string::npos);
    EXPECT_NE(why(planes({{0, 0, 0, 1}})).find("no direction"), std::string::npos);
    EXPECT_NE(why(planes({{1, 0, INFINITY, 1}})).find("finite"), std::string::npos);
    EXPECT_NE(why(planes({{1, 1, 1, -99}})).find("keeps nothing"), std::string::npos);
    EXPECT_NE(why(planes({{1, 1, 0, -9}, {-1, -1, 0, 8}})).find("planes: keeps nothing"),
              std::string::npos);
    for (const double thickness : {0.0, -2.0, double(NAN), double(INFINITY)})
        EXPECT_NE(why(slab(thickness)).find("slab"), std::string::npos);
    EXPECT_NE(why(planes(std::vector<std::array<double, 4>>(65, {1, 0, 0, 0}))), "");
    EXPECT_NE(why(balls({{0, 0, 0, 0}})).find("radius is 0"), std::string::npos);
    EXPECT_NE(why(balls({{0, 0, 0, -2}})).find("balls=0,0,0,-2"), std::string::npos);
    EXPECT_NE(why(balls({{0, NAN, 0, 2}})).find("finite"), std::string::npos);
    EXPECT_NE(why(balls({{0, 0, 0, INFINITY}})).find("finite"), std::string::npos);
    for (const std::array<double, 4>& odd :
         {std::array{1e300, 0.0, 0.0, 1.0}, {5, 8, 6, 1e300}, {5, 8, 6, 1e-300}})
        EXPECT_NE(why(balls({odd})).find("smallest spacing"), std::string::npos);
    EXPECT_NE(why(balls({{50, 8, 6, 4}})).find("balls: keeps nothing"), std::string::npos);
    EXPECT_NE(why(balls({{5, 8, 6, 2}, {15, 8, 6, 2}})).find("keeps nothing"), std::string::npos);
    EXPECT_NE(why(balls(std::vector<std::array<double, 4>>(65, {5, 8, 6, 2}))).find("at most"),
              std::string::npos);
    Case warp;
    warp.want.job = Job::warp;
    EXPECT_THROW(warp.clipped(slab(2)), RequestError);
}

}  // namespace
}  // namespace edgewise
