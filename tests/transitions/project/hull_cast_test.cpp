#include "transitions/project/hull_cast.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>
#include <vector>

#include "tests/transitions/project/looking.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/slab_hull.hpp"
#include "transitions/project/bricks_of.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

using namespace looking;

Parameters hull_steps(double step, const char* filter = "foh") {
    return {{"filter", filter}, {"step", step}};
}

Request hull_request(const Extent& input, const Extent& screen, const Matrix3d& by,
                     const Vec3& spacing = Vec3::Ones(), double zoom = 1) {
    Request want = seen(Mode::composite, input, screen, by, spacing, zoom);
    want.transfer.points = {{0.2, 0, {0.1, 0.2, 0.3}}, {1, 0.6, {1, 0.5, 0.2}}};
    return want;
}

Request surface_request(Request want, double level) {
    want.mode = mode_named("surface");
    want.surface.emplace();
    want.surface->isovalue = level;
    return want;
}

Request hull_eye(Request want, double distance) {
    Eye eye;
    eye.plane = double(want.screen.z - 1) / 2;
    eye.at =
        Vec3(double(want.screen.x - 1) / 2, double(want.screen.y - 1) / 2, eye.plane - distance);
    want.eye = eye;
    return want;
}

/// A rod along a diagonal of a face, and a small ball.
Data rod(const Extent& n) {
    return volume(n, [&](auto x, auto y, auto z) {
        const Vec3 p(double(x) - double(n.x) / 2, double(y) - double(n.y) / 2,
                     double(z) - double(n.z) / 2);
        const Vec3 along = Vec3(1, 1, 0.3).normalized();
        const double t = std::clamp(p.dot(along), -0.4 * double(n.x), 0.4 * double(n.x));
        return std::clamp(3.5 - (p - t * along).norm(), 0.0, 1.0);
    });
}

double farthest(const Data& a, const Data& b) {
    double most = 0;
    for (std::int64_t i = 0; i < a.what.samples() * a.what.channels; ++i) {
        const double x = a.as<float>()[i], y = b.as<float>()[i];
        most = std::max(most, std::abs(x - y));
        if (std::isnan(x) != std::isnan(y)) most = std::numeric_limits<double>::infinity();
    }
    return most;
}

double brightest(const Data& picture) {
    float most = 0;
    for (std::int64_t i = 0; i < picture.what.samples() * picture.what.channels; ++i)
        most = std::max(most, picture.as<float>()[i]);
    return double(most);
}

const Extent kRod{61, 57, 64}, kSeen{83, 79, 90};
/// Places along a ray are off by some roundings of f32 of numbers up to 90; values change by at
/// most 1 a sample there, and light by about as much. Some 100 samples differ, and not all alike.
constexpr double kPlaces = 100 * 90 * 0x1p-24;

TEST(HullCast, ShowsWhatTheCasterShows) {
    const Data in = rod(kRod);
    const Scene scene;
    for (const double degrees : {0.0, 37.0, 90.0, 160.0})
        for (const double distance : {0.0, 80.0})
            for (const double step : {0.3, 1.0, 2.7})
                for (const char* filter : {"zoh", "foh", "bspline3"}) {
                    Request want =
                        hull_request(kRod, kSeen, turn(degrees, {3, -2, 1}), {1, 1.2, 1.1});
                    if (distance > 0) want = hull_eye(want, distance);
                    Data read = Data::sharing(in, in.what);
                    if (filter == std::string("bspline3")) read.what.content = "coefficients";
                    const Ask ask{want, scene};
                    const Data by_hull = made(hull_cast(), read, ask, hull_steps(step, filter)),
                               by_cast = made(ray_cast(), read, ask, hull_steps(step, filter));
                    // The nearest sample jumps where a place is in the middle of two.
                    if (filter == std::string("zoh")) {
                        int differ = 0;
                        for (std::int64_t i = 0; i < kSeen.x * kSeen.y * 4; ++i)
                            differ += std::abs(by_hull.as<float>()[i] - by_cast.as<float>()[i]) >
                                      float(kPlaces);
                        EXPECT_LT(differ, 40) << degrees << ' ' << distance << ' ' << step;
                    } else {
                        EXPECT_LT(farthest(by_hull, by_cast), kPlaces)
                            << degrees << ' ' << distance << ' ' << step << ' ' << filter;
                    }
                    EXPECT_GT(brightest(by_hull), 0.1);
                }
}

TEST(HullCast, ShowsTheSameSurface) {
    const Data in = rod(kRod);
    const Scene scene;
    for (const double degrees : {0.0, 37.0, 110.0})
        for (const double distance : {0.0, 80.0}) {
            Request want = surface_request(
                hull_request(kRod, kSeen, turn(degrees, {3, -2, 1}), {1, 1.2, 1.1}), 0.5);
            want.shading.by = Shade::phong;
            if (distance > 0) want = hull_eye(want, distance);
            const Ask ask{want, scene};
            const Data by_hull = made(hull_cast(), in, ask, hull_steps(0.7)),
                       by_cast = made(ray_cast(), in, ask, hull_steps(0.7));
            int differ = 0;
            for (std::int64_t i = 0; i < by_hull.what.samples() * by_hull.what.channels; ++i)
                differ += std::abs(by_hull.as<float>()[i] - by_cast.as<float>()[i]) > 1e-3f;
            // Rays that graze the rod may hit it or not.
            EXPECT_LT(differ, 8) << degrees << ' ' << distance;
            EXPECT_GT(brightest(by_hull), 0.3);
        }
}

TEST(HullCast, ShowsTheSameInLightAndWithinClips) {
    const Data in = rod(kRod);
    const Scene scene;
    Request want = hull_request(kRod, kSeen, turn(37, {3, -2, 1}));
    want.shading.by = Shade::phong;
    const auto expect_same = [&](const char* what) {
        const Ask ask{want, scene};
        const Data by_hull = made(hull_cast(), in, ask, hull_steps(0.5)),
                   by_cast = made(ray_cast(), in, ask, hull_steps(0.5));
        // A normal changes by up to 1 in half a sample at the rod's axis, and light with it.
        EXPECT_LT(farthest(by_hull, by_cast), 20 * kPlaces) << what;
        EXPECT_GT(brightest(by_hull), 0.1) << what;
    };
    expect_same("lit");
    std::vector<HalfSpace> planes{{Vec3(1, 2, 0).normalized(), -38}, {-Vec3::UnitZ(), 40.2}};
    want.clips = {clip_of(kRod, planes)};
    expect_same("planes");
    Ball ball;
    ball.centre = Vec3(30, 28, 32);
    ball.to_unit = Matrix3d::Identity() / 14;
    const std::vector<Ball> balls{ball};
    want.clips = {clip_of(kRod, planes, balls)};
    expect_same("ball");
    want.clips.clear();
    want.shading.shadows = true;
    expect_same("shadows");
}

/// Samples that rays take of a rod, with and without a hull.
TEST(HullCast, TakesFewerSamplesOfARod) {
    const Extent n{160, 160, 160}, screen{100, 100, 200};
    const Data in = rod(n);
    const Request want = hull_request(n, screen, turn(37, {3, -2, 1}), Vec3::Ones(), 0.5);
    const kernels::Optics optics = optics_of(want, in.what.values);
    kernels::Taken taken;
    kernels::RayCast cast;
    cast.volume = kernels::grid_of(in);
    cast.rule = Combine::over;
    cast.rays = rays_of(in.what, want, 0, -0.5);
    cast.unit = want.unit;
    cast.optics = &optics;
    cast.taken = &taken;
    const auto count = [&] {
        taken = {};
        std::vector<float> out(static_cast<std::size_t>(screen.x * screen.y * 4));
        kernels::ray_cast(cast, 0, 0, screen.x, screen.y, out.data(), screen.x * 4);
        return double(taken.samples);
    };
    const double all = count();
    const auto bricks =
        bricks_of(cast.volume, {.optics = &optics}, std::pmr::new_delete_resource(), nullptr);
    const kernels::SlabHull hull = kernels::hull_of(*bricks, n, 0, true);
    const kernels::Kept kept = kernels::kept_in(hull, cast, kernels::strides_along_normals(cast));
    cast.kept = &kept;
    const double within = count();
    EXPECT_LT(within, all / 8);
    // The axes' slabs alone keep the box around the rod, which is most of the volume's middle.
    kernels::Kept box = kept;
    box.planes.clear();
    cast.kept = &box;
    const double in_box = count();
    EXPECT_LT(within, in_box / 2);
    cast.kept = &kept;
    cast.bricks = bricks.get();
    EXPECT_LT(count(), within);  // bricks leave out what is empty in the hull as well
    RecordProperty("samples", std::to_string(all) + " " + std::to_string(in_box) + " " +
                                  std::to_string(within) + " " + std::to_string(count()));
}

TEST(HullCast, HoldsAllThatMayBeSeen) {
    std::mt19937 bits(5);
    for (int round = 0; round < 20; ++round) {
        const Extent n{1 + std::int64_t(bits() % 30), 1 + std::int64_t(bits() % 30),
                       1 + std::int64_t(bits() % 30)};
        Data in = volume(n, [](auto...) { return 0.0; });
        for (int i = 0; i < 3; ++i) in.as<float>()[bits() % std::uint32_t(n.samples())] = 1;
        const Request want = hull_request(n, n, Matrix3d::Identity());
        const kernels::Optics optics = optics_of(want, in.what.values);
        const auto bricks = bricks_of(kernels::grid_of(in), {.optics = &optics},
                                      std::pmr::new_delete_resource(), nullptr);
        const kernels::SlabHull hull = kernels::hull_of(*bricks, n, 0, true);
        ASSERT_FALSE(hull.empty());
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x) {
                    if (*in.at<float>(x, y, z) == 0) continue;
                    for (std::size_t i = 0; i < kernels::SlabHull::kSlabs; ++i) {
                        const auto& normal = kernels::SlabHull::kNormal[i];
                        const double at = double(normal[0] * x + normal[1] * y + normal[2] * z);
                        // As far as a sample reaches.
                        double reach = 0;
                        const std::array<std::int64_t, 3> p{x, y, z};
                        for (int a = 0; a < 3; ++a) reach += std::abs(normal[std::size_t(a)]);
                        const bool inner =
                            std::all_of(p.begin(), p.end(), [](auto c) { return c > 0; }) &&
                            x + 1 < n.x && y + 1 < n.y && z + 1 < n.z;
                        if (!inner) reach = 0;
                        ASSERT_LE(hull.low[i], at - reach);
                        ASSERT_GE(hull.high[i], at + reach);
                    }
                }
    }
}

TEST(HullCast, ShowsNothingOfNothingAndAllOfOneVoxel) {
    const Scene scene;
    const Data empty = volume(kRod, [](auto...) { return 0.1; });
    const Request want = hull_request(kRod, kSeen, turn(37, {3, -2, 1}));
    EXPECT_EQ(brightest(made(hull_cast(), empty, {want, scene}, hull_steps(1))), 0);
    const Ask surface{surface_request(want, 0.5), scene};
    EXPECT_EQ(farthest(made(hull_cast(), empty, surface, hull_steps(1)),
                       made(ray_cast(), empty, surface, hull_steps(1))),
              0);
    const Extent one{1, 1, 1};
    const Data voxel = volume(one, [](auto...) { return 1.0; });
    const Request near = hull_request(one, {9, 9, 9}, turn(37, {3, -2, 1}), Vec3::Ones(), 4);
    EXPECT_LT(farthest(made(hull_cast(), voxel, {near, scene}, hull_steps(0.1)),
                       made(ray_cast(), voxel, {near, scene}, hull_steps(0.1))),
              1e-6);
    Data none = volume(kRod, [](auto...) { return std::numeric_limits<double>::quiet_NaN(); });
    Scene bad;
    bad.non_finite = kRod.samples();
    EXPECT_EQ(brightest(made(hull_cast(), none, {want, bad}, hull_steps(1))), 0);
    // One sample among what is not finite, in stored numbers that fall where values rise.
    *none.at<float>(30, 28, 31) = -1;
    *none.at<float>(31, 28, 31) = -1;
    none.what.values.slope = -1;
    const Ask ask{want, bad};
    EXPECT_LT(farthest(made(hull_cast(), none, ask, hull_steps(0.5, "zoh")),
                       made(ray_cast(), none, ask, hull_steps(0.5, "zoh"))),
              kPlaces);
    EXPECT_GT(brightest(made(hull_cast(), none, ask, hull_steps(0.5, "zoh"))), 0.1);
}

TEST(HullCast, ShowsTheSameSurfaceOfFallingNumbers) {
    Data in = rod(kRod);
    for (std::int64_t i = 0; i < kRod.samples(); ++i) in.as<float>()[i] = -in.as<float>()[i];
    in.what.values.slope = -1;
    const Scene scene;
    const Ask ask{surface_request(hull_request(kRod, kSeen, turn(37, {3, -2, 1})), 0.5), scene};
    const Data by_hull = made(hull_cast(), in, ask, hull_steps(0.7)),
               by_cast = made(ray_cast(), in, ask, hull_steps(0.7));
    int differ = 0;
    for (std::int64_t i = 0; i < by_hull.what.samples() * by_hull.what.channels; ++i)
        differ += std::abs(by_hull.as<float>()[i] - by_cast.as<float>()[i]) > 1e-3f;
    EXPECT_LT(differ, 8);
    EXPECT_GT(brightest(by_hull), 0.3);
}

TEST(HullCast, SameBytesForAnyThreadsAndAnyRegion) {
    const Data in = rod(kRod);
    const Scene scene;
    for (const double distance : {0.0, 80.0}) {
        Request want = hull_request(kRod, kSeen, turn(37, {3, -2, 1}), {1, 1.2, 1.1}, 1.2);
        if (distance > 0) want = hull_eye(want, distance);
        const Ask ask{want, scene};
        const auto with = [&](std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return made(hull_cast(), in, ask, hull_steps(0.6));
        };
        const Data one = with(1);
        for (const std::size_t threads : {2u, 7u}) EXPECT_EQ(farthest(with(threads), one), 0);
        const Region box{{13, 21, 0}, {70, 66, 1}};
        const Data part = made(hull_cast(), in, ask, box, hull_steps(0.6));
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            ASSERT_EQ(0, std::memcmp(part.at<float>(box.begin[0], y, 0),
                                     one.at<float>(box.begin[0], y, 0), 57 * 16));
    }
}

TEST(HullCast, RefusesWithReasons) {
    const Data in = rod(kRod);
    const Scene scene;
    const auto refused = [&](Mode mode) {
        return hull_cast()
            .offer(in.what, {seen(mode, kRod, kSeen, turn(3, {1, 1, 1})), scene}, hull_steps(1))
            .refused;
    };
    EXPECT_NE(refused(Mode::mip).find("samples that show nothing"), std::string::npos);
    EXPECT_NE(refused(Mode::xray), "");
    EXPECT_TRUE(hull_cast().on_demand);
}

}  // namespace
}  // namespace edgewise
