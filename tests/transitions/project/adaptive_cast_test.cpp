#include "transitions/project/adaptive_cast.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>
#include <vector>

#include "transitions/kernels/ray_path.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

using Eigen::Matrix3d;

constexpr Extent kInput{37, 29, 41}, kScreen{131, 97, 80};

Vec3 middle_of(const Extent& n) {
    return Vec3(double(n.x - 1), double(n.y - 1), double(n.z - 1)) / 2;
}

/// @param zoom  pixels a sample
Request turned(Mode mode, double degrees, double zoom = 2.5, const Extent& input = kInput,
               const Extent& screen = kScreen, const Vec3& spacing = Vec3::Ones()) {
    Request want;
    want.job = Job::render;
    want.mode = mode;
    if (mode->takes_level) want.surface = SurfaceOf{0.5};
    want.input = input;
    want.screen = screen;
    want.miss = -1;
    const Matrix3d turn =
        Eigen::AngleAxisd(degrees * EIGEN_PI / 180, Vec3(3, -2, 1).normalized()).matrix();
    Mat4 map = Mat4::Identity();
    map.topLeftCorner<3, 3>() =
        Vec3(zoom, zoom, 1).asDiagonal() * turn * Matrix3d(spacing.asDiagonal());
    map.topRightCorner<3, 1>() = middle_of(screen) - map.topLeftCorner<3, 3>() * middle_of(input);
    want.views = Placement(map);
    return want;
}

template <class Value>
Data volume_of(const Extent& n, Value&& value) {
    Representation what;
    what.extent = n;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x)
                *data.at<float>(x, y, z) =
                    static_cast<float>(value(double(x), double(y), double(z)));
    return data;
}

/// Smooth, between 0 and 1.
Data waves(const Extent& n = kInput) {
    return volume_of(n, [](double x, double y, double z) {
        return 0.5 + 0.5 * std::sin(0.2 * x) * std::cos(0.17 * (y + 2 * z));
    });
}

Parameters by(double tolerance, const std::string& filter = "foh", double step = 1) {
    return {{"filter", filter}, {"step", step}, {"tolerance", tolerance}};
}

Data made(const Transition& edge, const Data& in, const Ask& ask, const Parameters& with,
          Region region = {}) {
    const Offer offer = edge.offer(in.what, ask, with);
    EXPECT_EQ(offer.refused, "");
    if (region.empty()) region = Region::all(offer.to.extent);
    Data out = Data::make(offer.to, region, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, ask, in, out, region, context);
    return out;
}

bool same_bytes(const Data& a, const Data& b, std::int64_t x, std::int64_t y) {
    return std::memcmp(a.at<float>(x, y, 0), b.at<float>(x, y, 0),
                       sizeof(float) * static_cast<std::size_t>(a.what.channels)) == 0;
}

std::int64_t pixels_that_differ(const Data& a, const Data& b) {
    std::int64_t differ = 0;
    for (std::int64_t y = 0; y < a.what.extent.y; ++y)
        for (std::int64_t x = 0; x < a.what.extent.x; ++x) differ += !same_bytes(a, b, x, y);
    return differ;
}

std::vector<Mode> smooth_modes() {
    std::vector<Mode> all;
    for (const Mode mode : modes())
        if (mode->skips == ModeTraits::Levels::none && !mode->first_hit) all.push_back(mode);
    return all;
}

TEST(AdaptiveCast, IsTheCasterWhereNothingIsTolerated) {
    const Data in = waves();
    const Scene scene;
    for (const Mode mode : smooth_modes())
        for (const double degrees : {0.0, 37.0})
            for (const char* filter : {"foh", "keys"}) {
                const Request want = turned(mode, degrees);
                const Ask ask{want, scene};
                EXPECT_EQ(pixels_that_differ(made(adaptive_cast(), in, ask, by(0, filter)),
                                             made(ray_cast(), in, ask, by(0, filter))),
                          0)
                    << mode->name << ' ' << degrees << ' ' << filter;
            }
}

/// Errors at kinks are up to three times what is tolerated. Corners are cast. Faces of the data,
/// where pictures jump, may cross a square between its corners.
TEST(AdaptiveCast, ErrsByWhatIsTolerated) {
    const Data in = waves();
    Scene scene;
    constexpr double kTolerance = 0.005;
    for (const char* name : {"xray", "mean"})
        for (const double degrees : {0.0, 37.0, 110.0}) {
            SCOPED_TRACE(name + std::to_string(degrees));
            // Of integrals through 37 x 29 x 41 values below 1, or of their means.
            scene.range = mode_named(name)->divides ? 1 : 40;
            const Request want = turned(mode_named(name), degrees);
            const Ask ask{want, scene};
            const Data got = made(adaptive_cast(), in, ask, by(kTolerance)),
                       expected = made(ray_cast(), in, ask, by(kTolerance));
            kernels::RayCast rays;
            rays.volume.extent = kInput;
            rays.rays = rays_of(in.what, want, 0, -0.5);
            // The data are convex.
            const auto within = [&](std::int64_t x, std::int64_t y) {
                bool all = true;
                for (const int i : {-8, 8})
                    for (const int j : {-8, 8})
                        all = all && ray_path(rays, double(x + i), double(y + j)).hit();
                return all;
            };
            double squares = 0, pixels = 0;
            for (std::int64_t y = 0; y < kScreen.y; ++y)
                for (std::int64_t x = 0; x < kScreen.x; ++x) {
                    const bool corner = x % 4 == 0 && y % 4 == 0;
                    ASSERT_TRUE(!corner || same_bytes(got, expected, x, y)) << x << ' ' << y;
                    const double error = *got.at<float>(x, y, 0) - *expected.at<float>(x, y, 0);
                    if (!within(x, y)) continue;
                    ASSERT_LE(std::abs(error), 3 * kTolerance * scene.range) << x << ' ' << y;
                    squares += error * error;
                    ++pixels;
                }
            EXPECT_GT(pixels, 2000);
            EXPECT_LE(std::sqrt(squares / pixels), 0.5 * kTolerance * scene.range);
            EXPECT_GT(pixels_that_differ(got, expected), kScreen.x * kScreen.y / 10);
        }
}

/// Keys' cubics reproduce polynomials of second order: all pixels but those beside the faces are
/// the formula, whichever are cast. Pixels are samples, so that the caster adds up samples
/// themselves.
TEST(AdaptiveCast, InterpolatesAParabolaExactly) {
    constexpr Extent kBox{64, 64, 5};
    const auto height = [](double x, double y) {
        return 0.01 * x * x - 0.02 * x * y + 0.5 * y + 3;
    };
    const Data in = volume_of(kBox, [&](double x, double y, double) { return height(x, y); });
    const Request want = turned(Mode::xray, 0, 1, kBox, {64, 64, 5});
    Scene scene;
    scene.range = 5;
    const Ask ask{want, scene};
    const Data got = made(adaptive_cast(), in, ask, by(0.1));
    for (std::int64_t y = 8; y < 56; ++y)
        for (std::int64_t x = 8; x < 56; ++x) {
            const double exact = 5 * height(double(x), double(y));
            // f32 rounds samples of up to 80, sums of five, and some twenty products.
            ASSERT_NEAR(*got.at<float>(x, y, 0), exact, 30 * 5 * 80 * 0x1p-24) << x << ' ' << y;
        }
    EXPECT_GT(pixels_that_differ(got, made(ray_cast(), in, ask, by(0.1))), 500);
}

TEST(AdaptiveCast, TakesOddShapesEyesGapsAndThinVolumes) {
    Scene scene;
    scene.range = 40;
    const auto expect_close = [&](const Data& in, const Request& want, double share) {
        const Ask ask{want, scene};
        const Data got = made(adaptive_cast(), in, ask, by(0.002)),
                   expected = made(ray_cast(), in, ask, by(0.002));
        std::int64_t far = 0;
        for (std::int64_t y = 0; y < want.screen.y; ++y)
            for (std::int64_t x = 0; x < want.screen.x; ++x) {
                const double error = *got.at<float>(x, y, 0) - *expected.at<float>(x, y, 0);
                ASSERT_TRUE(std::isfinite(error));
                far += std::abs(error) > 0.002 * scene.range;
            }
        // Faces cross squares between their corners.
        EXPECT_LE(static_cast<double>(far), share * double(want.screen.x * want.screen.y));
    };
    const Extent thin{50, 40, 1}, rod{1, 1, 70}, one{1, 1, 1};
    expect_close(waves(thin), turned(Mode::xray, 20, 2, thin, {121, 90, 60}), 0.02);
    expect_close(waves(rod), turned(Mode::xray, 70, 2, rod, {121, 90, 60}), 0.01);
    expect_close(waves(one), turned(Mode::xray, 10, 20, one, {33, 47, 9}), 0.05);
    expect_close(waves(), turned(Mode::mean, 25, 2, kInput, {90, 101, 99}, Vec3(1, 1.6, 2.2)),
                 0.02);
    Request eye = turned(Mode::xray, 30);
    eye.eye = Eye{.at = Vec3(65, 48, -300), .plane = 40};
    expect_close(waves(), eye, 0.01);
    Data gaps = waves();
    std::mt19937 bits(3);
    for (int i = 0; i < 200; ++i)
        gaps.as<float>()[bits() % static_cast<std::uint32_t>(kInput.samples())] =
            i % 2 ? std::numeric_limits<float>::quiet_NaN()
                  : std::numeric_limits<float>::infinity();
    scene.non_finite = 200;
    expect_close(gaps, turned(Mode::mean, 30, 1.5), 0.02);
}

TEST(AdaptiveCast, SameBytesForAnyThreadsAndAnyRegion) {
    const Data in = waves();
    Scene scene;
    scene.range = 40;
    for (const Mode mode : smooth_modes()) {
        const Request want = turned(mode, 37);
        const Ask ask{want, scene};
        const auto with = [&](std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return made(adaptive_cast(), in, ask, by(0.002));
        };
        const Data one = with(1);
        for (const std::size_t threads : {2u, 7u})
            EXPECT_EQ(pixels_that_differ(with(threads), one), 0) << mode->name;
        const Region box{{50, 13, 0}, {111, 66, 1}};
        const Data part = made(adaptive_cast(), in, ask, by(0.002), box);
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            for (std::int64_t x = box.begin[0]; x < box.end[0]; ++x)
                ASSERT_TRUE(same_bytes(part, one, x, y)) << mode->name << ' ' << x << ' ' << y;
    }
}

TEST(AdaptiveCast, IsToldByDrawnSquares) {
    const Data in = waves();
    const Request want = turned(Mode::xray, 37);
    Scene scene;
    adaptive_cast().count(in, want, scene.facts, std::pmr::new_delete_resource());
    ASSERT_TRUE(scene.fact(FactName("adaptive/spread")));
    double before = 0;
    for (int bound = 3; bound <= 14; ++bound) {
        const double share = *scene.fact(FactName("adaptive/cast/" + std::to_string(bound)));
        EXPECT_GE(share, before);
        EXPECT_LE(share, 1);
        before = share;
    }
    scene.facts["picture/foh/1"] = 0.2;
    const Ask ask{want, scene};
    kernels::RayCast rays;
    rays.volume.extent = kInput;
    rays.rays = rays_of(in.what, want, 0, -0.5);
    for (const double tolerance : {0.01, 0.03, 0.06}) {
        const Parameters with = by(tolerance);
        const Offer offer = adaptive_cast().offer(in.what, ask, with);
        ASSERT_EQ(offer.refused, "");
        const Offer plain = ray_cast().offer(in.what, ask, with);
        // What is predicted beyond the caster's error is no less than what is met, over rays that
        // meet the data, and less than what is tolerated.
        const double predicted =
            adaptive_cast().error(offer, ask).bias - ray_cast().error(plain, ask).bias;
        const Data got = made(adaptive_cast(), in, ask, with),
                   expected = made(ray_cast(), in, ask, with);
        double squares = 0, pixels = 0;
        for (std::int64_t y = 0; y < kScreen.y; ++y)
            for (std::int64_t x = 0; x < kScreen.x; ++x) {
                if (!ray_path(rays, double(x), double(y)).hit()) continue;
                squares += std::pow(
                    double(*got.at<float>(x, y, 0)) - double(*expected.at<float>(x, y, 0)), 2);
                ++pixels;
            }
        const double met = std::sqrt(squares / pixels);
        EXPECT_LE(met, predicted) << tolerance;
        EXPECT_GT(met, 0) << tolerance;
        EXPECT_LE(predicted, tolerance * *scene.fact(FactName("adaptive/spread")));
        // Of the rays those of corners, and of squares that differ.
        const double cast = adaptive_cast().work(offer, ask, 0).gathers,
                     all = ray_cast().work(plain, ask, 0).gathers;
        EXPECT_GT(cast, all / 16);
        EXPECT_LT(cast, all);
    }
    const auto gathers = [&](double tolerance) {
        const Offer offer = adaptive_cast().offer(in.what, ask, by(tolerance));
        return adaptive_cast().work(offer, ask, 0).gathers;
    };
    EXPECT_GT(gathers(0.01), gathers(0.06));
}

TEST(AdaptiveCast, LeavesRoomForDetailBetweenCorners) {
    // Single bright samples, rays a sample apart: most of them lie between the corners of a square.
    // Few squares of a wide screen meet the data.
    std::mt19937 bits(4);
    for (const int one_in : {1000, 4000, 16000}) {
        const Data in = volume_of(
            {64, 64, 30}, [&](double, double, double) { return double(bits() % one_in == 0); });
        const Request want = turned(Mode::xray, 20, 1, in.what.extent, {300, 300, 90});
        Scene scene;
        adaptive_cast().count(in, want, scene.facts, std::pmr::new_delete_resource());
        scene.facts["picture/foh/1"] = 0;
        const Ask ask{want, scene};
        const Parameters with = by(0.004);
        const Offer offer = adaptive_cast().offer(in.what, ask, with);
        if (!offer.refused.empty()) continue;  // too many of the squares differ
        const Data got = made(adaptive_cast(), in, ask, with),
                   expected = made(ray_cast(), in, ask, with);
        kernels::RayCast rays;
        rays.volume.extent = in.what.extent;
        rays.rays = rays_of(in.what, want, 0, -0.5);
        double squares = 0, pixels = 0;
        for (std::int64_t y = 0; y < want.screen.y; ++y)
            for (std::int64_t x = 0; x < want.screen.x; ++x) {
                if (!ray_path(rays, double(x), double(y)).hit()) continue;
                squares += std::pow(
                    double(*got.at<float>(x, y, 0)) - double(*expected.at<float>(x, y, 0)), 2);
                ++pixels;
            }
        EXPECT_LE(std::sqrt(squares / pixels), adaptive_cast().error(offer, ask).bias) << one_in;
        EXPECT_GT(squares, 0) << one_in;
    }
}

TEST(AdaptiveCast, Refuses) {
    Scene scene;
    Representation what;
    what.extent = kInput;
    const auto refused = [&](const Request& want, const Parameters& with = by(0.002)) {
        return adaptive_cast().offer(what, {want, scene}, with).refused;
    };
    EXPECT_NE(refused(turned(Mode::mip, 10)).find("mode mip"), std::string::npos);
    EXPECT_NE(refused(turned(Mode::composite, 10)).find("mode composite"), std::string::npos);
    EXPECT_NE(refused(turned(Mode::xray, 10, 1, kInput, {20, 90, 50})).find("20 x 90"),
              std::string::npos);
    EXPECT_NE(refused(turned(Mode::xray, 10), by(0.002, "bspline3")), "");
    EXPECT_NE(refused(turned(Mode::xray, 10), by(0.002, "zoh")).find("steps"), std::string::npos);
    Request warp = turned(Mode::xray, 10);
    warp.job = Job::warp;
    EXPECT_NE(refused(warp), "");
    EXPECT_EQ(refused(turned(Mode::xray, 10)), "");
    // Noise, a pixel a sample.
    std::mt19937 bits(9);
    const Data in = volume_of(kInput, [&](double, double, double) { return double(bits() % 100); });
    const Request want = turned(Mode::xray, 10, 1.6, kInput, {36, 36, 60});
    adaptive_cast().count(in, want, scene.facts, std::pmr::new_delete_resource());
    EXPECT_NE(refused(want, by(0.001)).find(" % of the rays differ by more than"),
              std::string::npos)
        << refused(want, by(0.001));
}

}  // namespace
}  // namespace edgewise
