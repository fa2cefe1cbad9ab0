#include "request/geometry.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <fmt/format.h>
#include <fstream>
#include <gtest/gtest.h>

#include "graph/errors.hpp"
#include "settings/settings.hpp"

namespace edgewise::cli {
namespace {

constexpr double kRadian = 3.14159265358979323846 / 180;

InputGrid volume(Extent extent, Vec3 spacing = Vec3::Ones()) {
    InputGrid grid;
    grid.extent = extent;
    grid.spacing = spacing;
    return grid;
}

InputGrid image(std::int64_t x, std::int64_t y) {
    InputGrid grid;
    grid.axes = 2;
    grid.extent = {x, y, 1};
    return grid;
}

/// Geometry as it is typed.
struct GeometryWords {
    std::optional<std::string> view, about, perspective, eye, look_at, spacing, size, zoom, move;
    std::vector<std::pair<std::string, std::string>> steps;
};

Geometry geometry_of(const GeometryWords& words, const InputGrid& grid, Job job) {
    std::vector<Given> given;
    for (const auto& [name, value] : words.steps) given.push_back({name, value});
    for (const auto& [name, value] : {std::pair{"view", &words.view},
                                      {"about", &words.about},
                                      {"perspective", &words.perspective},
                                      {"eye", &words.eye},
                                      {"look_at", &words.look_at},
                                      {"spacing", &words.spacing},
                                      {"size", &words.size},
                                      {"zoom", &words.zoom},
                                      {"grid_moves", &words.move}})
        if (*value) given.push_back({name, **value});
    return edgewise::geometry_of(query_of(job, given, {}).geometry, grid, job);
}

GeometryWords with(std::string step, std::string value) {
    GeometryWords words;
    words.steps = {{std::move(step), std::move(value)}};
    return words;
}

Vec3 moved(const Geometry& geometry, const Vec3& index, int view = 0) {
    return sent(geometry.views.at(view), index).value();
}

Vec3 centre(const Extent& e) { return {(e.x - 1) / 2.0, (e.y - 1) / 2.0, (e.z - 1) / 2.0}; }

TEST(Geometry, NoneIsTheIdentityExactly) {
    const auto grid = volume({7, 8, 9}, {0.898437, 0.3, 1.7});
    const Geometry geometry = geometry_of(GeometryWords{}, grid, Job::warp);
    EXPECT_EQ(geometry.views.at(0), Mat4::Identity());
    EXPECT_EQ(geometry.grid.extent, grid.extent);
    EXPECT_EQ(geometry.grid.spacing, grid.spacing);
}

TEST(Geometry, APositiveTurnAboutZIsClockwiseOnThePicture) {
    const Geometry geometry = geometry_of(with("rotate", "90"), image(5, 5), Job::warp);
    // Right of the centre comes to lie below it: y is down.
    EXPECT_EQ(moved(geometry, {4, 2, 0}), Vec3(2, 4, 0));
}

TEST(Geometry, QuarterTurnsAreExact) {
    const auto grid = volume({10, 7, 6});
    for (const char* turn : {"90,0,0", "0,90,0", "0,0,-90", "180,270,90", "450,-90,720"}) {
        const Mat4 map = geometry_of(with("rotate", turn), grid, Job::warp).views.at(0);
        for (int i = 0; i < 16; ++i) {
            const double twice = 2 * map.data()[i];
            EXPECT_EQ(twice, std::round(twice)) << turn;
        }
    }
}

TEST(Geometry, TwoEighthTurnsAreAQuarterTurn) {
    GeometryWords words = with("rotate", "45");
    words.steps.emplace_back("rotate", "45");
    EXPECT_EQ(geometry_of(words, image(64, 64), Job::warp).views.at(0),
              geometry_of(with("rotate", "90"), image(64, 64), Job::warp).views.at(0));
}

TEST(Geometry, RotatesAboutXThenYThenZ) {
    const auto grid = volume({11, 12, 13});
    const Geometry geometry = geometry_of(with("rotate", "10,-20,35"), grid, Job::warp);
    const Mat3 expected = (Eigen::AngleAxisd(35 * kRadian, Vec3::UnitZ()) *
                           Eigen::AngleAxisd(-20 * kRadian, Vec3::UnitY()) *
                           Eigen::AngleAxisd(10 * kRadian, Vec3::UnitX()))
                              .toRotationMatrix();
    // Entries are products of at most three rounded cosines.
    EXPECT_LT((geometry.views.at(0).topLeftCorner<3, 3>() - expected).cwiseAbs().maxCoeff(), 1e-15);
    EXPECT_LT((moved(geometry, centre(grid.extent)) - centre(grid.extent)).norm(), 1e-14);
}

TEST(Geometry, TurnsInTheFilesUnitNotInSamples) {
    // A turn by 30 degrees keeps lengths in millimetres, with samples 1 x 2 x 0.5 mm apart.
    const Vec3 spacing(1, 2, 0.5);
    const Geometry geometry =
        geometry_of(with("rotate", "30,40,50"), volume({20, 20, 20}, spacing), Job::warp);
    const Vec3 a(3, 7, 5), b(13, 2, 18);
    const Vec3 before = (a - b).cwiseProduct(spacing);
    const Vec3 after = (moved(geometry, a) - moved(geometry, b)).cwiseProduct(spacing);
    EXPECT_NEAR(before.norm(), after.norm(), 1e-12);
}

TEST(Geometry, StepsApplyInTheOrderGiven) {
    GeometryWords turn_first = with("rotate", "90"), shift_first = with("translate", "3,0");
    turn_first.steps.emplace_back("translate", "3,0");
    shift_first.steps.emplace_back("rotate", "90");
    const Vec3 middle(10, 10, 0);
    EXPECT_EQ(moved(geometry_of(turn_first, image(21, 21), Job::warp), middle), Vec3(13, 10, 0));
    EXPECT_EQ(moved(geometry_of(shift_first, image(21, 21), Job::warp), middle), Vec3(10, 13, 0));
}

TEST(Geometry, ShearAndScale) {
    const Geometry sheared = geometry_of(with("shear", "xy=0.5"), image(5, 5), Job::warp);
    EXPECT_EQ(moved(sheared, {2, 4, 0}), Vec3(3, 4, 0));
    const Geometry scaled = geometry_of(with("scale", "2,3"), image(5, 5), Job::warp);
    EXPECT_EQ(moved(scaled, {3, 3, 0}), Vec3(4, 5, 0));
}

TEST(Geometry, AboutTheFirstSampleAMatrixMeansWhatItMeansToOpenCv) {
    GeometryWords words = with("matrix", "0.8,-0.2,5,0.1,1.1,-3");
    words.about = "0,0";
    const Geometry geometry = geometry_of(words, image(30, 20), Job::warp);
    const Vec3 p(7, 11, 0);
    const Vec3 expected(0.8 * 7 - 0.2 * 11 + 5, 0.1 * 7 + 1.1 * 11 - 3, 0);
    EXPECT_LT((moved(geometry, p) - expected).norm(), 1e-13);
}

TEST(Geometry, AHomographyDivides) {
    GeometryWords words = with("matrix", "1,0.1,2,0,1.2,1,0.001,0.002,1");
    words.about = "0,0";
    const Geometry geometry = geometry_of(words, image(30, 20), Job::warp);
    const double w = 0.001 * 7 + 0.002 * 11 + 1;
    const Vec3 expected((7 + 1.1 + 2) / w, (1.2 * 11 + 1) / w, 0);
    const Vec3 at = moved(geometry, {7, 11, 0});
    EXPECT_LT((at.head<2>() - expected.head<2>()).norm(), 1e-12);
    // The same homography, all signs turned.
    words.steps[0].second = "-1,-0.1,-2,0,-1.2,-1,-0.001,-0.002,-1";
    EXPECT_LT((moved(geometry_of(words, image(30, 20), Job::warp), {7, 11, 0}) - at).norm(), 1e-12);
}

TEST(Geometry, MatricesComeFromFilesToo) {
    const std::string file = testing::TempDir() + "edgewise_matrix.txt";
    std::ofstream(file) << "# a shift\n1 0 0 2\n0, 1, 0, 3\n0\t0 1 4 # the last row\n";
    const Geometry geometry = geometry_of(with("matrix", file), volume({5, 5, 5}), Job::warp);
    EXPECT_EQ(moved(geometry, {0, 0, 0}), Vec3(2, 3, 4));
}

/// Where directions of the patient (LPS) go on the screen of a file with a given orientation.
Vec3 on_screen(const char* view, const char* letters, const Vec3& lps) {
    const Mat3 direction = directions_of(letters);
    return view_of(view, direction) * direction.inverse() * lps;
}

TEST(Views, ShowTheHeadUpAndNothingMirrored) {
    const Vec3 left(1, 0, 0), posterior(0, 1, 0), superior(0, 0, 1);
    const Vec3 right_of_screen(1, 0, 0), up(0, -1, 0), away(0, 0, 1);
    for (const char* letters : {"LPS", "RAS", "LPI", "SAR", "PIL"}) {
        EXPECT_EQ(on_screen("front", letters, superior), up);
        EXPECT_EQ(on_screen("front", letters, left), right_of_screen);
        EXPECT_EQ(on_screen("front", letters, posterior), away);
        EXPECT_EQ(on_screen("back", letters, superior), up);
        EXPECT_EQ(on_screen("back", letters, left), Vec3(-right_of_screen));
        EXPECT_EQ(on_screen("left", letters, superior), up);
        EXPECT_EQ(on_screen("left", letters, posterior), right_of_screen);
        EXPECT_EQ(on_screen("right", letters, posterior), Vec3(-right_of_screen));
        // Face up; from below the patient's left is on the right, as radiologists look.
        EXPECT_EQ(on_screen("bottom", letters, posterior), Vec3(-up));
        EXPECT_EQ(on_screen("bottom", letters, left), right_of_screen);
        EXPECT_EQ(on_screen("top", letters, posterior), Vec3(-up));
        EXPECT_EQ(on_screen("top", letters, left), Vec3(-right_of_screen));
    }
}

TEST(Views, ObliqueScansTakeTheNearestAxis) {
    const Mat3 oblique =
        Eigen::AngleAxisd(20 * kRadian, Vec3(1, 1, 1).normalized()).toRotationMatrix();
    EXPECT_EQ(view_of("front", oblique), view_of("front", Mat3::Identity()));
    EXPECT_EQ(letters_of(oblique), "LPS");
    EXPECT_EQ(letters_of(directions_of("SRA")), "SRA");
}

TEST(Views, HaveTheNamesOfPlanesAndAnyCase) {
    const Mat3 direction = directions_of("RAS");
    EXPECT_EQ(view_of("Coronal", direction), view_of("front", direction));
    EXPECT_EQ(view_of("sagittal", direction), view_of("LEFT", direction));
    EXPECT_EQ(view_of("axial", direction), view_of("bottom", direction));
}

TEST(Views, AlongTheFilesAxesSlicesLieAsStored) {
    const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
    EXPECT_EQ(view_of("z", Mat3::Identity()), Mat3::Identity());
    EXPECT_EQ(view_of("x", Mat3::Identity()) * y, x);
    EXPECT_EQ(view_of("x", Mat3::Identity()) * z, y);
    EXPECT_EQ(view_of("y", Mat3::Identity()) * x, x);
    EXPECT_EQ(view_of("y", Mat3::Identity()) * z, y);
    EXPECT_EQ(view_of("y", Mat3::Identity()) * y, Vec3(-z));  // seen against y
    for (const char* view : {"x", "y", "z", "front", "back", "left", "right", "top", "bottom"})
        EXPECT_EQ(view_of(view, Mat3::Identity()).determinant(), 1) << view;
}

TEST(Pictures, TakeTheSmallestSpacingAndCutNothingOff) {
    const auto grid = volume({100, 100, 40}, {0.5, 0.5, 3});
    GeometryWords words;
    words.view = "x";  // right y, down z
    const Geometry geometry = geometry_of(words, grid, Job::render);
    EXPECT_EQ(geometry.grid.extent, (Extent{100, 240, 100}));
    EXPECT_EQ(geometry.unit, 0.5);
    // The first and last slices are half a slice, 1.5 mm or 3 pixels, from the edge.
    EXPECT_DOUBLE_EQ(moved(geometry, {0, 0, 0}).y(), 2.5);
    EXPECT_DOUBLE_EQ(moved(geometry, {0, 0, 39}).y(), 236.5);
}

TEST(Pictures, AllFramesOfATurntableAreCovered) {
    GeometryWords words = with("rotate", "20,0,5");
    words.steps.emplace_back("turntable", "7");
    const auto grid = volume({30, 40, 50}, {1, 0.7, 1.3});
    const Geometry geometry = geometry_of(words, grid, Job::render);
    ASSERT_EQ(geometry.views.size(), 7u);
    double closest = 1;
    for (int view = 0; view < 7; ++view)
        for (const Vec3& corner : corners_of(grid)) {
            const Vec3 at = moved(geometry, corner, view);
            for (int k = 0; k < 3; ++k) {
                EXPECT_GE(at[k], -0.5 - 1e-9);
                EXPECT_LE(at[k], double(geometry.grid.extent[k]) - 0.5 + 1e-9);
            }
            closest = std::min(closest, at.y() + 0.5);
        }
    EXPECT_LT(closest, 0.5);  // no wider than needed: less than half a pixel on each side
}

TEST(Pictures, FrameHalfWayRoundIsTheBack) {
    GeometryWords turned, back;
    turned.view = "front";
    turned.steps = {{"turntable", "4"}};
    back.view = "back";
    turned.size = back.size = "80x80";  // else each is as wide as its own frames
    const auto grid = volume({30, 40, 50});
    EXPECT_EQ(geometry_of(turned, grid, Job::render).views.at(2),
              geometry_of(back, grid, Job::render).views.at(0));
}

TEST(Sizes, AloneChangesTheSpacingByOneFactor) {
    GeometryWords words;
    words.size = "50x25";
    const Geometry geometry = geometry_of(words, image(100, 100), Job::warp);
    EXPECT_EQ(geometry.grid.extent, (Extent{50, 25, 1}));
    EXPECT_EQ(geometry.grid.spacing.head<2>(), Vec3(4, 4, 0).head<2>());  // not stretched
    EXPECT_EQ(moved(geometry, {49.5, 49.5, 0}), Vec3(24.5, 12, 0));
}

TEST(Sizes, WithSpacingCropAboutTheCentre) {
    GeometryWords words;
    words.size = "50x20";
    words.spacing = "1";
    const Geometry geometry = geometry_of(words, image(100, 100), Job::warp);
    EXPECT_EQ(moved(geometry, {25, 40, 0}), Vec3(0, 0, 0));
}

TEST(Sizes, FitHoldsTheTurnedImage) {
    GeometryWords words = with("rotate", "90");
    words.size = "fit";
    const Geometry geometry = geometry_of(words, image(30, 20), Job::warp);
    EXPECT_EQ(geometry.grid.extent, (Extent{20, 30, 1}));
    EXPECT_EQ(moved(geometry, {0, 0, 0}), Vec3(19, 0, 0));
    words.steps = {{"rotate", "30"}};
    const double c = std::cos(30 * kRadian), s = 0.5;
    const Extent extent = geometry_of(words, image(30, 20), Job::warp).grid.extent;
    EXPECT_EQ(extent.x, std::ceil(30 * c + 20 * s));
    EXPECT_EQ(extent.y, std::ceil(30 * s + 20 * c));
}

TEST(Perspective, TheEyeSeesEveryCornerAtTheAngle) {
    GeometryWords words = with("rotate", "20,30,0");
    words.perspective = "40";
    words.steps.emplace_back("turntable", "5");
    const auto grid = volume({30, 40, 50}, {1, 0.7, 1.3});
    const Geometry geometry = geometry_of(words, grid, Job::render);
    const Eye eye = geometry.eye.value();
    const double height = double(geometry.grid.extent.y) * geometry.grid.spacing.y();
    const double plane = (eye.plane - eye.at.z()) * geometry.unit;
    EXPECT_NEAR(height / 2 / plane, std::tan(20 * kRadian), 1e-12);
    double widest = 0;
    for (int view = 0; view < 5; ++view)
        for (const Vec3& corner : corners_of(grid)) {
            const Vec3 p = moved(geometry, corner, view) - eye.at;
            ASSERT_GT(p.z(), 0);
            const double scale = (eye.plane - eye.at.z()) / p.z();
            const double x = std::abs(p.x()) * scale / double(geometry.grid.extent.x) * 2;
            const double y = std::abs(p.y()) * scale / double(geometry.grid.extent.y) * 2;
            widest = std::max({widest, x, y});
        }
    EXPECT_NEAR(widest, 1, 1e-9);  // one corner touches the frame, none leaves it
}

TEST(PlacedEye, IsWhereTheSampleIsInEveryView) {
    const Vec3 at(7.25, 30, -4);
    InputGrid grid = volume({30, 40, 50}, {1, 0.7, 1.3});
    Mat3 points = Mat3::Identity();
    points.col(2) = Vec3(0.1, 0.4, 1).normalized();
    for (const bool leans : {false, true}) {
        if (leans) take_axes(grid, points);
        GeometryWords words = with("turntable", "5");
        words.steps.emplace_back("scale", "2,1,-1");
        words.perspective = "40";
        words.eye = "7.25,30,-4";
        words.look_at = "3,50,20.5";
        words.zoom = "1.5";
        const Geometry geometry = geometry_of(words, grid, Job::render);
        const Eye eye = geometry.eye.value();
        ASSERT_EQ(geometry.views.size(), 5U);
        for (int view = 0; view < 5; ++view)
            EXPECT_LT((moved(geometry, at, view) - eye.at).norm(), 1e-10) << view;
        EXPECT_EQ(eye.at.x(), double(geometry.grid.extent.x - 1) / 2);
        EXPECT_EQ(eye.at.y(), double(geometry.grid.extent.y - 1) / 2);
        const double height = double(geometry.grid.extent.y) * geometry.grid.spacing.y() * 1.5;
        EXPECT_NEAR(height / 2 / ((eye.plane - eye.at.z()) * geometry.unit), std::tan(20 * kRadian),
                    1e-12);
    }
}

TEST(PlacedEye, WhatItLooksAtIsInTheMiddle) {
    InputGrid grid = volume({30, 40, 50}, {1, 0.7, 1.3});
    Mat3 points = Mat3::Identity();
    points.col(2) = Vec3(0.1, 0.4, 1).normalized();
    take_axes(grid, points);
    GeometryWords words;
    words.view = "left";
    words.perspective = "40";
    words.eye = "7.25,30,-4";
    // The last two lie along axes of the grid, which leans.
    for (const Vec3& at :
         {Vec3(3, 50, 20.5), Vec3(-9, 2, -40), Vec3(20, 30, -4), Vec3(7.25, 30, 60)}) {
        words.look_at = fmt::format("{},{},{}", at[0], at[1], at[2]);
        const Geometry geometry = geometry_of(words, grid, Job::render);
        const Eye eye = geometry.eye.value();
        const Vec3 to = moved(geometry, at) - eye.at;
        EXPECT_NEAR(to.x(), 0, 1e-9 * to.z());
        EXPECT_NEAR(to.y(), 0, 1e-9 * to.z());
        EXPECT_GT(to.z(), 0);
        // A turn, never a mirror: lengths and handedness are kept.
        const Mat3 turn = geometry.grid.spacing.asDiagonal() *
                          Mat3(geometry.views[0].topLeftCorner<3, 3>()) *
                          (grid.lean * grid.spacing.asDiagonal()).inverse();
        EXPECT_LT((turn * turn.transpose() - Mat3::Identity()).norm(), 1e-12);
        EXPECT_NEAR(turn.determinant(), 1, 1e-12);
    }
}

TEST(PlacedEye, LookingAlongAnAxisIsExactlyThatView) {
    const Mat3 turn = looking_along({0, 0, 0.3});
    EXPECT_EQ(turn, Mat3::Identity());
    Mat3 up, down;
    up << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    down << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    EXPECT_EQ(looking_along({0, -5, 0}), up);
    EXPECT_EQ(looking_along({0, 1e-300, 0}), down);
    EXPECT_LT((looking_along({0, 7, 1e-6}) - down).norm(), 1e-6);  // from the level ahead
}

TEST(Zoom, ShowsTheMiddleLarger) {
    GeometryWords words = with("rotate", "20,30,0");
    words.perspective = "40";
    words.size = "60x50";
    const auto grid = volume({30, 40, 50}, {1, 0.7, 1.3});
    const Geometry all = geometry_of(words, grid, Job::render);
    words.zoom = "2";
    const Geometry middle = geometry_of(words, grid, Job::render);
    EXPECT_EQ(middle.grid.extent, all.grid.extent);
    // The same eye, and every point twice as far from the middle of the picture.
    EXPECT_EQ(middle.eye->at, all.eye->at);
    EXPECT_EQ(middle.eye->plane, all.eye->plane);
    const Vec3 at(3, 4, 5), centre_of_picture(29.5, 24.5, 0);
    const Vec3 once = moved(all, at) - centre_of_picture,
               twice = moved(middle, at) - centre_of_picture;
    EXPECT_NEAR(twice.x(), 2 * once.x(), 1e-12);
    EXPECT_NEAR(twice.y(), 2 * once.y(), 1e-12);
    EXPECT_NEAR(twice.z(), once.z(), 1e-12);
}

TEST(Turntable, TurnsAtItsPlaceAmongTheSteps) {
    const auto grid = volume({30, 40, 50});
    GeometryWords from_above, tilted;
    from_above.steps = {{"turntable", "6"}, {"rotate", "15,0,0"}};
    tilted.steps = {{"rotate", "15,0,0"}, {"turntable", "6"}};
    from_above.spacing = tilted.spacing = "1";
    const Mat3 about_y = rotation_of(0, 60, 0), about_x = rotation_of(15, 0, 0);
    const auto turn = [&](const GeometryWords& words, int view) -> Mat3 {
        return geometry_of(words, grid, Job::render)
            .views.at(std::size_t(view))
            .topLeftCorner<3, 3>();
    };
    // The first view of each is tilted alike; the next one is turned before it or after it. Pixels
    // are as large as units of depth, so turns are compared but for one factor.
    const auto same = [](const Mat3& a, const Mat3& b) {
        return (a / a.norm() - b / b.norm()).cwiseAbs().maxCoeff() < 1e-12;
    };
    EXPECT_TRUE(same(turn(from_above, 0), about_x));
    EXPECT_TRUE(same(turn(from_above, 1), about_x * about_y));
    EXPECT_TRUE(same(turn(tilted, 1), about_y * about_x));
}

TEST(Sizes, OneNumberIsTheLongerSide) {
    GeometryWords words;
    words.size = "50";
    const Geometry photo = geometry_of(words, image(100, 61), Job::warp);
    EXPECT_EQ(photo.grid.extent, (Extent{50, 31, 1}));  // 30.5: nothing is cut off
    EXPECT_DOUBLE_EQ(photo.grid.spacing.x(), 2);
    EXPECT_DOUBLE_EQ(photo.grid.spacing.y(), 2);
    const Geometry picture = geometry_of(words, volume({100, 30, 40}), Job::render);
    EXPECT_EQ(picture.grid.extent.x, 50);
    EXPECT_EQ(picture.grid.extent.y, 15);
    words.spacing = "1";  // then it crops
    EXPECT_EQ(geometry_of(words, image(100, 60), Job::warp).grid.spacing.x(), 1);
}

TEST(Sizes, OnePlaneIsCutOutOfAVolumeAndNotAVolumeMadeThin) {
    GeometryWords words;
    words.size = "80x60x1";
    const Geometry geometry = geometry_of(words, volume({40, 40, 20}, {1, 1, 2}), Job::warp);
    EXPECT_EQ(geometry.grid.extent, (Extent{80, 60, 1}));
    EXPECT_DOUBLE_EQ(geometry.grid.spacing.x(), 40.0 / 60);
    EXPECT_DOUBLE_EQ(geometry.depth, 20 * 1.5);
}

/// The largest difference between where a header and a geometry say that output samples lie.
double misplaced(const Geometry& geometry, const InputGrid& grid, const Mat4& turn) {
    double worst = 0;
    const Extent& e = geometry.grid.extent;
    for (const Vec3& at :
         {Vec3(0, 0, 0), Vec3(double(e.x), 0, 3), Vec3(2, double(e.y), double(e.z))}) {
        // Where the sample lies, moved, is where its value comes from.
        const Vec3 lies = sent(geometry.lies, at).value();
        const Vec3 shows = sent(Mat4(geometry.views[0].inverse()), at).value();
        const auto place = [&](const Vec3& index) -> Vec3 {
            return grid.lean * (index - centre(grid.extent)).cwiseProduct(grid.spacing);
        };
        worst = std::max(worst, (sent(turn, place(shows)).value() - place(lies)).norm());
    }
    return worst;
}

TEST(Headers, ViewsTurnTheGridAndStepsTheContent) {
    InputGrid grid = volume({20, 30, 12}, {1, 0.7, 2.5});
    Mat3 points = rotation_of(20, 10, -30);
    points.col(2) = (points.col(2) + 0.3 * points.col(0)).normalized();
    take_axes(grid, points);
    ASSERT_TRUE(grid.leans());
    GeometryWords words;
    words.view = "x";
    EXPECT_LT(misplaced(geometry_of(words, grid, Job::warp), grid, Mat4::Identity()), 1e-12);
    EXPECT_EQ(geometry_of(words, grid, Job::warp).grid.extent, (Extent{30, 12, 20}));
    words.steps = {{"rotate", "5,6,7"}};
    for (const char* size : {"", "15x14x13", "9", "fit"}) {
        if (*size) words.size = size;
        // The content turns about the view's axes, which are the grid's own perpendicular ones.
        const Mat3 view = view_of("x", Mat3::Identity());
        Mat4 turn = Mat4::Identity();
        turn.topLeftCorner<3, 3>() = view.transpose() * rotation_of(5, 6, 7) * view;
        words.move.reset();
        EXPECT_LT(misplaced(geometry_of(words, grid, Job::warp), grid, turn), 1e-12) << size;
        words.move = "Grid";
        EXPECT_LT(misplaced(geometry_of(words, grid, Job::warp), grid, Mat4::Identity()), 1e-12);
    }
}

TEST(Headers, AViewOfALeaningGridIsACopy) {
    InputGrid grid = volume({20, 30, 12}, {1, 0.7, 2.5});
    Mat3 points = Mat3::Identity();
    points.col(2) = Vec3(0.1, 0.4, 1).normalized();
    take_axes(grid, points);
    for (const char* view : {"front", "left", "bottom", "y", "z"}) {
        GeometryWords words;
        words.view = view;
        const Mat3 map = geometry_of(words, grid, Job::warp).views[0].topLeftCorner<3, 3>();
        EXPECT_EQ(map, view_of(view, grid.direction)) << view;
    }
}

TEST(Leaning, PicturesOfALeaningGridAreInMillimetres) {
    InputGrid grid = volume({40, 40, 40}, {1, 1, 1.118});
    Mat3 points = Mat3::Identity();
    points.col(2) = Vec3(0, 0.5, 1).normalized();
    take_axes(grid, points);
    GeometryWords words;
    words.view = "x";  // right y, down z
    const Geometry geometry = geometry_of(words, grid, Job::render);
    const double unit = geometry.unit;
    const Vec3 step = (moved(geometry, {5, 5, 6}) - moved(geometry, {5, 5, 5})) * unit;
    EXPECT_NEAR(step.x(), 0.5, 1e-4);  // 1.118 x (0.5, 1) / sqrt(1.25)
    EXPECT_NEAR(step.y(), 1, 1e-4);
}

TEST(Leaning, NoiseOfDirectionsIsNoLean) {
    InputGrid grid = volume({512, 512, 300}, {0.7, 0.7, 1});
    Mat3 points = rotation_of(11, -7, 3).cast<float>().cast<double>();
    points.col(1) += 1e-4 * points.col(0);  // 0.05 samples at the end of the grid
    take_axes(grid, points);
    EXPECT_FALSE(grid.leans());
    points.col(1) += 1e-3 * points.col(0);
    take_axes(grid, points);
    EXPECT_TRUE(grid.leans());
}

TEST(Geometry, ATurntableOverAnArcHasEqualSteps) {
    const auto grid = volume({9, 9, 9});
    const Geometry arc = geometry_of(with("turntable", "6,90"), grid, Job::render);
    const Geometry all = geometry_of(with("turntable", "24"), grid, Job::render);
    ASSERT_EQ(arc.views.size(), 6u);
    for (int view = 0; view < 6; ++view) {
        const auto turn = arc.views[view].topLeftCorner<3, 3>();
        EXPECT_TRUE(turn.isApprox(all.views[view].topLeftCorner(3, 3), 1e-14)) << view;
    }
    const Geometry back = geometry_of(with("turntable", "4,-360"), grid, Job::render);
    const Geometry forth = geometry_of(with("turntable", "4"), grid, Job::render);
    EXPECT_EQ(back.views[1], forth.views[3]);
}

/// A file with a text in it, for as long as a test needs it.
struct PathText {
    std::string name = testing::TempDir() + "edgewise_path.txt";
    explicit PathText(const std::string& text) { std::ofstream(name) << text; }
    ~PathText() { std::remove(name.c_str()); }
};

TEST(Geometry, APathIsAMatrixAView) {
    const auto grid = volume({9, 8, 7}, {1, 1, 2});
    // In a line, as rows between blank lines, with comments, 3x3 and 4x4.
    const PathText file(
        "# three views\n1 0 0 0 1 0 0 0 1\n0,0,1,  0,1,0, -1,0,0 # a quarter turn\n\n"
        "1 0 0 2\n0 1 0 -3 # rows\n# between\n0 0 1 0\n0 0 0 1\n\n\n"
        "1 0 0 2 0 1 0 -3 0 0 1 0");
    const Geometry path = geometry_of(with("path", file.name), grid, Job::render);
    ASSERT_EQ(path.views.size(), 4u);
    GeometryWords words = with("rotate", "0,90,0");
    words.size = fmt::format("{}x{}", path.grid.extent.x, path.grid.extent.y);
    words.spacing = "1";
    const Geometry one = geometry_of(words, grid, Job::render);
    EXPECT_TRUE(path.views[1].topLeftCorner(3, 3).isApprox(one.views[0].topLeftCorner(3, 3)));
    EXPECT_EQ(path.views[2], path.views[3]);
    EXPECT_EQ(Vec3(path.views[2].topRightCorner<3, 1>() - path.views[0].topRightCorner<3, 1>()),
              Vec3(2, -3, 0));
}

TEST(Geometry, APathTakesItsPlaceAmongTheSteps) {
    const auto grid = volume({9, 9, 9});
    const PathText file("0 0 1 0 1 0 -1 0 0\n");
    GeometryWords words;
    words.steps = {{"rotate", "20,0,0"}, {"path", file.name}, {"scale", "1.5"}};
    GeometryWords same = words;
    same.steps[1] = {"matrix", "0,0,1,0,1,0,-1,0,0"};
    words.about = same.about = "2,3,4";
    const Geometry path = geometry_of(words, grid, Job::render);
    const Geometry matrix = geometry_of(same, grid, Job::render);
    ASSERT_EQ(path.views.size(), 1u);
    EXPECT_TRUE(path.views[0].isApprox(matrix.views[0], 1e-13));
}

TEST(Geometry, RefusesPathsThatMakeNoSense) {
    const auto grid = volume({9, 9, 9});
    const auto why = [&](const std::string& text) {
        const PathText file(text);
        try {
            geometry_of(with("path", file.name), grid, Job::render);
        } catch (const RequestError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    const std::string one = "1 0 0 0 1 0 0 0 1\n";
    EXPECT_EQ(why(one), "");
    EXPECT_NE(why("").find("has no matrix"), std::string::npos);
    EXPECT_NE(why("# nothing\n\n").find("has no matrix"), std::string::npos);
    EXPECT_NE(why(one + "1 2 3\n\n" + one).find("3 numbers from line 2 on"), std::string::npos);
    EXPECT_NE(why(one + "1 2 x\n").find("line 2"), std::string::npos);
    EXPECT_NE(why(one + "1 0 0 0 1 0 0 0 0\n").find("matrix 2"), std::string::npos);
    EXPECT_NE(why(one + "1 0 0 0 1 0 0 nan 0\n"), "");
    EXPECT_NE(why("1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\n").find("last row"), std::string::npos);
    EXPECT_THROW(geometry_of(with("path", "no such file"), grid, Job::render), RequestError);
    const PathText file(one);
    EXPECT_THROW(geometry_of(with("path", file.name), grid, Job::warp), RequestError);
    for (const char* other : {"path", "turntable"}) {
        GeometryWords words = with("path", file.name);
        words.steps.emplace_back(other, other == std::string("path") ? file.name : "4");
        EXPECT_THROW(geometry_of(words, grid, Job::render), RequestError);
    }
}

class Refused : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(Refused, WithTheNameOfTheSetting) {
    const auto [step, value] = GetParam();
    for (const InputGrid& grid : {image(9, 9), volume({9, 9, 9})}) try {
            geometry_of(with(step, value), grid, Job::warp);
            FAIL() << step << " " << value;
        } catch (const RequestError& error) {
            EXPECT_NE(std::string(error.what()).find(step), std::string::npos) << error.what();
        }
}

INSTANTIATE_TEST_SUITE_P(Geometry, Refused,
                         testing::Values(std::pair{"rotate", "nan"}, std::pair{"rotate", "1,2"},
                                         std::pair{"rotate", "inf,0,0"}, std::pair{"rotate", ""},
                                         std::pair{"rotate", "1,,2"}, std::pair{"scale", "0"},
                                         std::pair{"scale", "1,2,3,4"}, std::pair{"translate", "1"},
                                         std::pair{"translate", "1,2,x"},
                                         std::pair{"shear", "xx=1"}, std::pair{"shear", "xy"},
                                         std::pair{"shear", "xw=1"}, std::pair{"matrix", "1,2,3"},
                                         std::pair{"matrix", "1,0,0,0,0,0,0,0,1"},
                                         std::pair{"matrix", "no such file"},
                                         std::pair{"matrix", "1,0,0,0,1,0,0,0,nan"}));

TEST(Geometry, RefusesSizesAndViewsThatMakeNoSense) {
    const auto refused = [](auto change, Job job, const InputGrid& grid) {
        GeometryWords words;
        change(words);
        EXPECT_THROW(geometry_of(words, grid, job), RequestError);
    };
    const auto cube = volume({9, 9, 9});
    for (const char* size : {"0x0", "0", "5x5", "5x5x5x5", "-5x5x5", "ax5x5", "5x5x", "-5"})
        refused([&](auto& w) { w.size = size; }, Job::warp, cube);
    for (const char* spacing : {"0", "-1", "1,2", "nan"})
        refused([&](auto& w) { w.spacing = spacing; }, Job::warp, cube);
    for (const char* fov : {"0", "180", "-3", "x"})
        refused([&](auto& w) { w.perspective = fov; }, Job::render, cube);
    refused([](auto& w) { w.view = "above"; }, Job::render, cube);
    refused([](auto& w) { w.view = "front"; }, Job::warp, image(9, 9));
    refused([](auto& w) { w.steps = {{"turntable", "0"}}; }, Job::render, cube);
    refused([](auto& w) { w.steps = {{"turntable", "4"}}; }, Job::warp, cube);
    refused([](auto& w) { w.steps = {{"turntable", "4"}, {"turntable", "4"}}; }, Job::render, cube);
    for (const char* turn : {"4,0", "4,nan", "4,90,2", "4,", ",90", "2.5,90"})
        refused([&](auto& w) { w.steps = {{"turntable", turn}}; }, Job::render, cube);
    for (const char* by : {"0", "-1", "nan", "x"})
        refused([&](auto& w) { w.zoom = by; }, Job::render, cube);
    refused([](auto& w) { w.zoom = "2"; }, Job::warp, cube);
    refused([](auto& w) { w.move = "grid"; }, Job::render, cube);
    refused([](auto& w) { w.move = "both"; }, Job::warp, cube);
    refused([](auto& w) { w.about = "1,2"; }, Job::warp, cube);
    refused([](auto& w) { w.size = "fit"; }, Job::render, cube);
    EXPECT_THROW(directions_of("RRS"), RequestError);
    EXPECT_THROW(directions_of("RA"), RequestError);
}

}  // namespace
}  // namespace edgewise::cli
