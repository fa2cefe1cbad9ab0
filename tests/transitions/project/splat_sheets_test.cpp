#include "transitions/project/splat_sheets.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>
#include <vector>

#include "tests/transitions/project/looking.hpp"
#include "transitions/kernels/splat_sheets.hpp"
#include "transitions/project/ray_cast.hpp"

namespace edgewise {
namespace {

using namespace looking;
using Eigen::Matrix3d;

Request looked_at(Mode mode, const Extent& input, const Extent& screen, const Matrix3d& by,
                  const Vec3& spacing = Vec3::Ones(), double zoom = 1) {
    Request want = seen(mode, input, screen, by, spacing, zoom);
    want.transfer.points = {{0, 0, {0.1, 0.2, 0.3}}, {1, 0.1, {1, 0.5, 0}}};
    return want;
}

Parameters thick(double slab) { return {{"slab", slab}}; }

/// A ray in f64, where t counts from the front of the screen's first layer.
struct Sight {
    Vec3 origin, direction;
    double low = 0, high = -1;

    Sight(const Request& want, double px, double py) {
        const Mat4 back = want.views.at(0).matrix().inverse();
        origin = (back * Eigen::Vector4d(px, py, -0.5, 1)).head<3>();
        direction = back.topLeftCorner<3, 3>().col(2);
        low = -1e300, high = 1e300;
        for (int axis = 0; axis < 3; ++axis) {
            const double first = -0.5, last = double(want.input[axis]) - 0.5;
            if (std::abs(direction[axis]) < 1e-12) {
                if (origin[axis] < first || origin[axis] > last) high = low;
                continue;
            }
            const double a = (first - origin[axis]) / direction[axis];
            const double b = (last - origin[axis]) / direction[axis];
            low = std::max(low, std::min(a, b));
            high = std::min(high, std::max(a, b));
        }
    }
    bool hits() const { return low < high; }
};

/// What sheets stand for: means of the field over slabs whose middle is inside, as far as they are;
/// the lengths of others go to the nearest one.
Stretch expected(const Data& data, const Request& want, double px, double py, double slab) {
    Stretch stretch = Stretch::empty(want.mode);
    const Sight ray(want, px, py);
    if (!ray.hits()) return stretch;
    const double low = ray.low / slab, high = ray.high / slab;
    for (auto k = std::int64_t(std::ceil(low - 0.5 + 1e-6)); double(k) + 0.5 < high - 1e-6; ++k) {
        const double begin = std::max(low, double(k)), end = std::min(high, double(k + 1));
        double sum = 0;
        constexpr int kPoints = 16;
        for (int i = 0; i < kPoints; ++i) {
            const double t = slab * (begin + (end - begin) * (i + 0.5) / kPoints);
            sum += trilinear(data, ray.origin + t * ray.direction);
        }
        const double first = double(k) - 0.5 < low + 1e-6 ? low : double(k);
        const double last = double(k) + 1.5 > high - 1e-6 ? high : double(k + 1);
        stretch.add(sum / kPoints, slab * (last - first), want);
    }
    return stretch;
}

struct Scenery {
    Extent input, screen;
    Matrix3d by;
    Vec3 spacing = Vec3::Ones();
    double zoom = 1;
    double slab = 1;
};

std::vector<Scenery> sceneries() {
    const Extent n{21, 17, 26}, screen{44, 41, 45};
    return {
        {n, screen, Matrix3d::Identity()},
        {n, screen, turn(37, {3, -2, 1})},
        {n, screen, turn(37, {3, -2, 1}), {1, 1, 1}, 1, 0.5},
        {n, screen, turn(75, {0, 1, 0}), {1, 1, 1}, 1, 2},
        {n, screen, turn(165, {0, 3, 1})},
        {{21, 17, 12}, {60, 60, 60}, turn(130, {1, 2, 3}), {1, 1.3, 3.1}},
        {{40, 40, 40}, {19, 17, 70}, turn(25, {1, 1, 0}), {1, 1, 1}, 0.21, 1.3},
        {{12, 9, 10}, {70, 60, 20}, turn(-50, {1, 0, 2}), {1, 1, 1}, 4.7},
    };
}

TEST(SplatSheets, SamplesAreMeansOfTheFieldOverSlabs) {
    for (const Scenery& of : sceneries())
        for (const Mode mode : {Mode::composite, Mode::mip}) {
            const Data in = volume(of.input, wave);
            const Request want = looked_at(mode, of.input, of.screen, of.by, of.spacing, of.zoom);
            const Scene scene{.commonest = 0.5};
            const Data got = made(splat_sheets(), in, {want, scene}, thick(of.slab));
            double squares = 0, count = 0;
            for (std::int64_t y = 0; y < of.screen.y; ++y)
                for (std::int64_t x = 0; x < of.screen.x; ++x) {
                    std::array<double, 4> values{};
                    const Stretch ray = expected(in, want, double(x), double(y), of.slab);
                    if (ray.length == 0) continue;
                    ray.result(want, values.data());
                    for (int c = 0; c < mode->channels; ++c) {
                        const double error =
                            double(got.at<float>(x, y, 0)[c]) - values[std::size_t(c)];
                        // Half a cell of 1/16 along two axes, and a section at either end of a slab
                        // of which at least half is inside: of values that are at most 1 a mean is
                        // off by that share, where faces are cut by several voxels a slice.
                        ASSERT_NEAR(error, 0, mode == Mode::mip ? 0.25 : 0.05)
                            << x << " " << y << " " << c;
                        squares += error * error;
                        ++count;
                    }
                }
            // Inside, errors are those of slopes, see splat_test.cpp.
            EXPECT_LT(std::sqrt(squares / count), mode == Mode::mip ? 0.02 : 0.002);
        }
}

TEST(SplatSheets, AConstantHasNoRipple) {
    const Extent slab{61, 57, 9}, screen{31, 27, 90};
    const Data in = volume(slab, [](auto...) { return 0.7; });
    const Scene scene;  // zeros are empty
    for (const Matrix3d& by : {Matrix3d(Matrix3d::Identity()), turn(17.3, {0, 0, 1}),
                               turn(25, {1, 0, 0}), turn(160, {1, 2, 0})})
        for (const double zoom : {0.5, 1.0, 2.3}) {
            const Request want =
                looked_at(Mode::composite, slab, screen, by, Vec3(1, 1, 1.7), zoom);
            const Data got = made(splat_sheets(), in, {want, scene}, thick(1));
            int rays = 0;
            for (std::int64_t y = 0; y < screen.y; ++y)
                for (std::int64_t x = 0; x < screen.x; ++x) {
                    const Sight ray(want, double(x), double(y));
                    bool through = ray.hits();
                    for (const double t : {ray.low, ray.high}) {
                        const Vec3 at = ray.origin + t * ray.direction;
                        through = through && std::abs(at.z() - 4) > 4.499 &&
                                  std::abs(at.x() - 30) < 30.4 && std::abs(at.y() - 28) < 28.4;
                    }
                    if (!through) continue;
                    ++rays;
                    // EQ 63; rays end where less than 2^-12 is left.
                    const double opacity = 1 - std::pow(1 - 0.07, ray.high - ray.low);
                    ASSERT_NEAR(got.at<float>(x, y, 0)[3], opacity, 2e-5) << x << " " << y;
                }
            EXPECT_GT(rays, 20);
        }
}

TEST(SplatSheets, WhatIsOpaqueHidesWhatIsBehind) {
    const Extent n{31, 31, 21};
    const Data in = volume(n, [](auto, auto, auto z) { return z < 10 ? 1 : z < 12 ? 0 : 0.5; });
    for (const double degrees : {0, 20, 160, 180}) {
        Request want = looked_at(Mode::composite, n, {50, 50, 50}, turn(degrees, {0, 1, 0}));
        want.transfer.points = {{0.2, 0, {}},           {0.4, 0.99, {0, 1, 0}},
                                {0.6, 0.99, {0, 1, 0}}, {0.7, 0, {0, 1, 0}},
                                {0.8, 0, {1, 0, 0}},    {0.9, 0.99, {1, 0, 0}}};
        const Scene scene;
        const Data got = made(splat_sheets(), in, {want, scene}, thick(1));
        const float* middle = got.at<float>(25, 25, 0);
        const bool red = degrees < 90;
        EXPECT_GT(middle[red ? 0 : 1], 0.999);
        EXPECT_LT(middle[red ? 1 : 0], 1e-3);
    }
}

TEST(SplatSheets, AreNearTheRayCaster) {
    const Extent n{40, 33, 37};
    const Data in = volume(n, [](auto x, auto y, auto z) {
        const double r = std::hypot(double(x) - 20, double(y) - 15, double(z) - 18);
        return std::clamp(1.5 - std::abs(r - 9) / 2, 0.0, 1.0);
    });
    const Extent screen{64, 64, 64};
    for (const Matrix3d& by : {turn(0, {0, 0, 1}), turn(37, {3, -2, 1}), turn(120, {0, 2, 1})})
        for (const double slab : {0.5, 1.0}) {
            const Request want = looked_at(Mode::composite, n, screen, by);
            const Scene scene;
            const Data sheets = made(splat_sheets(), in, {want, scene}, thick(slab));
            const Data cast =
                made(ray_cast(), in, {want, scene}, {{"filter", "foh"}, {"step", slab}});
            double squares = 0, most = 0;
            for (std::int64_t i = 0; i < 4 * cast.what.samples(); ++i) {
                squares += std::pow(sheets.as<float>()[i] - cast.as<float>()[i], 2);
                most = std::max<double>(most, cast.as<float>()[i]);
            }
            EXPECT_GT(most, 0.5);
            // A mean over a slab against a sample at its middle: a curvature of 1 at the shell's
            // sides, over a slab's length squared / 24, of a few samples of opacity 0.1.
            EXPECT_LT(std::sqrt(squares / double(4 * cast.what.samples())), 0.01);
        }
}

TEST(SplatSheets, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{30, 25, 41}, screen{101, 133, 60};
    std::mt19937 random(7);
    const Data in = volume(n, [&](auto...) { return random() % 9 ? 0.0 : double(random() % 2); });
    for (const char* name : {"composite", "mip", "minip"}) {
        const Mode mode = mode_named(name);
        const Request want = looked_at(mode, n, screen, turn(37, {3, -2, 1}), {1, 1, 1}, 1.8);
        const Scene scene;
        const Ask ask{want, scene};
        const auto with = [&](std::size_t threads) {
            const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
            return made(splat_sheets(), in, ask, thick(1));
        };
        const Data one = with(1);
        for (const std::size_t threads : {2u, 7u})
            EXPECT_EQ(0, std::memcmp(one.samples.data(), with(threads).samples.data(),
                                     static_cast<std::size_t>(one.what.bytes())));
        const Region box{{13, 21, 0}, {90, 110, 1}};
        const Data part = made(splat_sheets(), in, ask, box, thick(1));
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
            ASSERT_EQ(0, std::memcmp(part.at<float>(13, y, 0), one.at<float>(13, y, 0),
                                     77 * sizeof(float) * one.what.channels));
    }
}

TEST(SplatSheets, EmptySheetsChangeNothing) {
    // One needs all sheets, for what is empty could be seen; the other leaves them out.
    const Extent n{20, 20, 20};
    const Data in = volume(n, [](auto x, auto y, auto z) { return x == 5 && y > 9 && z == 12; });
    for (const Mode mode : {Mode::composite, Mode::mip}) {
        const Request want = looked_at(mode, n, {40, 40, 40}, turn(40, {1, 2, 1}));
        const Scene common{.commonest = 0}, other{.commonest = 0.25};
        const Data few = made(splat_sheets(), in, {want, common}, thick(1));
        const Data all = made(splat_sheets(), in, {want, other}, thick(1));
        double squares = 0;
        const auto numbers = few.what.samples() * few.what.channels;
        for (std::int64_t i = 0; i < numbers; ++i)
            squares += std::pow(few.as<float>()[i] - all.as<float>()[i], 2);
        // At faces a quarter is off by sections.
        EXPECT_LT(std::sqrt(squares / double(numbers)), 0.02);
    }
}

TEST(SplatSheets, ThinVolumesAreThoseOfTheField) {
    for (const Extent& n :
         {Extent{1, 1, 1}, {1, 20, 20}, {20, 1, 20}, {20, 20, 1}, {2, 2, 2}, {50, 1, 1}}) {
        const Data in = volume(n, [](auto...) { return 1; });
        const Request want = looked_at(Mode::composite, n, {61, 63, 61}, turn(33, {1, 2, 3}));
        const Scene scene;
        const Data got = made(splat_sheets(), in, {want, scene}, thick(1));
        double squares = 0, most = 0;
        for (std::int64_t y = 0; y < 63; ++y)
            for (std::int64_t x = 0; x < 61; ++x) {
                std::array<double, 4> values{};
                expected(in, want, double(x), double(y), 1).result(want, values.data());
                squares += std::pow(got.at<float>(x, y, 0)[3] - values[3], 2);
                most = std::max(most, values[3]);
            }
        EXPECT_LT(std::sqrt(squares / (61 * 63)), 0.05 * most) << n.x << " " << n.y << " " << n.z;
    }
}

TEST(SplatSheets, CountsThePixelsOfFootprintsOnEachSheet) {
    const Extent n{64, 64, 64};
    Representation what;
    what.extent = n;
    const Request want = looked_at(Mode::composite, n, {112, 112, 112}, turn(37, {3, -2, 1}));
    Scene scene;
    scene.occupied_fraction = 0.02;
    const auto work = [&](double slab) {
        const Ask ask{want, scene};
        return splat_sheets().work(splat_sheets().offer(what, ask, thick(slab)), ask, 0);
    };
    // A cube of two voxels' side, turned, lies on 2 to 5 sheets, or on half as many of twice the
    // thickness.
    const Work one = work(1), two = work(2);
    EXPECT_GT(one.gathers, 0.02 * 64 * 64 * 64 * 2 * 9 * 2);
    EXPECT_LT(one.gathers, 0.02 * 64 * 64 * 64 * 2 * 16 * 6 * 1.3);
    EXPECT_LT(two.gathers, one.gathers);
    EXPECT_LT(two.operations, one.operations);
}

TEST(SplatSheets, RefusesWhatItCannotDo) {
    const Extent n{20, 21, 22};
    Representation what;
    what.extent = n;
    Scene scene;
    const auto expect = [&](const Request& want, double slab, const std::string& reason) {
        const std::string said = splat_sheets().offer(what, {want, scene}, thick(slab)).refused;
        EXPECT_NE(said.find(reason), std::string::npos) << said;
    };
    const auto plain = [&](Mode mode) {
        return looked_at(mode, n, {40, 40, 40}, turn(20, {1, 2, 3}));
    };
    for (const Mode mode : modes()) {
        const bool takes = mode->combine == Combine::over || mode->combine == Combine::max;
        const std::string said = splat_sheets().offer(what, {plain(mode), scene}, thick(1)).refused;
        EXPECT_EQ(said.empty(), takes) << mode->name;
    }
    expect(plain(Mode::xray), 1, "what hides");
    Request want = plain(Mode::composite);
    want.eye = Eye{};
    expect(want, 1, "eye");
    want = plain(Mode::composite);
    want.clips.resize(1);
    expect(want, 1, "clip");
    want = plain(Mode::composite);
    want.field = Field::nearest;
    expect(want, 1, "labels");
    // Four units between slices: a slab of half a unit is an eighth of a voxel.
    expect(looked_at(Mode::mip, n, {90, 90, 90}, turn(0, {1, 0, 0}), {1, 1, 4}), 0.5,
           "0.125 voxels thick; at least 0.25");
    what.extent = want.input = {3, 3, 2001};
    want = looked_at(Mode::mip, want.input, {9, 9, 2001}, turn(0, {1, 0, 0}));
    expect(want, 1, "2001 voxels; at most 2000");
    what.extent = n;
    scene.non_finite = 17;
    expect(plain(Mode::mip), 1, "17 samples are not finite");
}

}  // namespace
}  // namespace edgewise
