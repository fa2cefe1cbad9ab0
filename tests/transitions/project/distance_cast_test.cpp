#include "transitions/project/distance_cast.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>
#include <vector>

#include "tests/transitions/project/looking.hpp"
#include "transitions/kernels/brick_distances.hpp"
#include "transitions/project/bricks_of.hpp"
#include "transitions/project/picture.hpp"
#include "transitions/project/ray_cast.hpp"
#include "transitions/project/stretches.hpp"

namespace edgewise {
namespace {

using Eigen::Matrix3d;
using looking::made;
using looking::seen;
using looking::turn;

/// Nothing but a few small bright balls.
template <class T>
Data beads(Type type, const Extent& n, ValueMap values = {}) {
    Representation what;
    what.extent = n;
    what.type = type;
    what.values = values;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    std::fill_n(data.as<T>(), n.samples(), T{2});
    std::mt19937 bits(7);
    for (int bead = 0; bead < 6; ++bead) {
        const auto place = [&](std::int64_t count) {
            return std::int64_t(bits() % std::uint64_t(count));
        };
        const std::int64_t x = place(n.x), y = place(n.y), z = place(n.z);
        for (std::int64_t k = std::max<std::int64_t>(0, z - 2); k < std::min(n.z, z + 3); ++k)
            for (std::int64_t j = std::max<std::int64_t>(0, y - 2); j < std::min(n.y, y + 3); ++j)
                for (std::int64_t i = std::max<std::int64_t>(0, x - 2); i < std::min(n.x, x + 3);
                     ++i)
                    *data.at<T>(i, j, k) = static_cast<T>(40 + 9 * bead - (i - x) * (i - x));
    }
    return data;
}

void add_transfer(Request& want, bool grey) {
    // Opaque at 0, which is no sample, and clear from there to the beads.
    want.transfer.points = {{0, 0.9, {1, 1, 1}},
                            {1, 0, {0, 0, 0}},
                            {4, 0, {0, 0, 0}},
                            {60, 0.4, {1, 0.7, 0.2}},
                            {100, 1, {1, 1, 1}}};
    if (grey)
        for (Transfer::Point& point : want.transfer.points)
            point.color = {point.color[0], point.color[0], point.color[0]};
}

void expect_same(const Data& got, const Data& expected) {
    for (std::int64_t i = 0; i < got.what.samples() * got.what.channels; ++i)
        ASSERT_EQ(std::memcmp(got.as<float>() + i, expected.as<float>() + i, sizeof(float)), 0)
            << "number " << i << ": " << got.as<float>()[i] << " for " << expected.as<float>()[i];
}

void expect_same_as_cast(const Data& in, const Request& want, double step, double leap,
                         const Scene& scene = {}) {
    SCOPED_TRACE(std::string(want.mode->name) + " " + std::string(name_of(in.what.type)) + " " +
                 std::to_string(step) + " " + std::to_string(leap));
    const Ask ask{want, scene};
    expect_same(made(distance_cast(), in, ask, {{"step", step}, {"leap", leap}}),
                made(ray_cast(), in, ask, {{"filter", "foh"}, {"step", step}}));
}

void sweep(const Data& in, const Scene& scene = {}) {
    const Extent& n = in.what.extent;
    for (const char* name : {"mip", "minip", "composite"})
        for (const double degrees : {0.0, 33.0, 157.0})
            for (const bool from_eye : {false, true})
                for (const double step : {1.0, 0.4, 2.7}) {
                    Request want = seen(mode_named(name), n, {75, 50, 80},
                                        turn(degrees, {3, -2, 1}), Vec3(1, 1.3, 1.1));
                    if (from_eye) want.eye = Eye{.at = Vec3(37, 24.5, -40), .plane = 40};
                    want.miss = want.mode->negated ? 1e4 : -1e4;
                    add_transfer(want, degrees == 33);
                    expect_same_as_cast(in, want, step, 127, scene);
                    expect_same_as_cast(in, want, step, 1, scene);
                }
}

TEST(DistanceCast, IsTheCasterBitForBit) {
    sweep(beads<std::uint8_t>(Type::u8, {67, 59, 71}));
    sweep(beads<std::int16_t>(Type::i16, {41, 50, 37}, {-0.5, 30}));
    sweep(beads<float>(Type::f32, {40, 55, 38}, {2, -1}));
    for (const Extent& n : {Extent{1, 1, 1}, Extent{30, 1, 8}, Extent{1, 1, 60}})
        sweep(beads<float>(Type::f32, n));
}

TEST(DistanceCast, PassesOverWhatIsNotFinite) {
    Data in = beads<float>(Type::f32, {40, 37, 45});
    for (std::int64_t z = 0; z < 22; ++z)
        for (std::int64_t y = 0; y < 22; ++y)
            std::fill_n(in.at<float>(0, y, z), 22, std::numeric_limits<float>::quiet_NaN());
    *in.at<float>(30, 30, 30) = std::numeric_limits<float>::infinity();
    Scene scene;
    scene.non_finite = 22 * 22 * 22 + 1;
    sweep(in, scene);
}

TEST(DistanceCast, DistancesAreThoseOfTheNearestBrick) {
    std::mt19937 bits(3);
    for (const Extent& n : {Extent{61, 50, 47}, Extent{4, 90, 3}, Extent{1, 1, 1}})
        for (const int most : {1, 3, 127}) {
            kernels::Bricks bricks(n, std::pmr::new_delete_resource());
            for (float& level : bricks.level) level = bits() % 60 == 0 ? 1.0f : 0.0f;
            const kernels::BrickDistances to(bricks, 0, most, std::pmr::new_delete_resource());
            const Extent& count = bricks.extent;
            const auto at = [&](std::int64_t i, std::int64_t j, std::int64_t k) {
                return std::size_t((k * count.y + j) * count.x + i);
            };
            for (std::int64_t k = 0; k < count.z; ++k)
                for (std::int64_t j = 0; j < count.y; ++j)
                    for (std::int64_t i = 0; i < count.x; ++i) {
                        std::int64_t nearest = most;
                        for (std::int64_t c = 0; c < count.z; ++c)
                            for (std::int64_t b = 0; b < count.y; ++b)
                                for (std::int64_t a = 0; a < count.x; ++a)
                                    if (bricks.level[at(a, b, c)] > 0)
                                        nearest = std::min(
                                            nearest, std::max({std::abs(a - i), std::abs(b - j),
                                                               std::abs(c - k)}));
                        ASSERT_EQ(to.distance[at(i, j, k)], nearest) << i << ' ' << j << ' ' << k;
                    }
        }
}

/// Steps over bricks that do not matter, counted: leaps take far fewer.
TEST(DistanceCast, LeapsTakeFewerSteps) {
    const Extent n{128, 128, 128};
    const Data in = beads<std::uint8_t>(Type::u8, n);
    Request want = seen(Mode::composite, n, {120, 120, 200}, turn(33, {3, -2, 1}));
    add_transfer(want, true);
    const Scene scene;
    const Ask ask{want, scene};
    const Offer offer = distance_cast().offer(in.what, ask, {{"step", 1.0}, {"leap", 127.0}});
    const StretchRays rays(offer, ask, in, 0);
    const auto bricks = bricks_of(rays.cast().volume, {.optics = rays.optics()},
                                  std::pmr::new_delete_resource(), {});
    std::vector<float> out(120 * 120 * 4);
    const auto taken = [&](int leap) {
        const kernels::BrickDistances to(*bricks, 0, leap, std::pmr::new_delete_resource());
        kernels::StretchesTaken counted;
        kernels::stretch_cast({.cast = rays.cast(), .bricks = &to, .taken = &counted}, 0, 0, 120,
                              120, out.data(), 480);
        return counted;
    };
    const kernels::StretchesTaken plain = taken(1), leaps = taken(127);
    EXPECT_EQ(plain.samples, leaps.samples);
    EXPECT_EQ(plain.unsampled, leaps.unsampled);
    EXPECT_LT(4 * leaps.passed, plain.passed);
}

TEST(DistanceCast, SameBytesForAnyThreadsAndAnyRegion) {
    const Extent n{90, 70, 80};
    const Data in = beads<std::int16_t>(Type::i16, n);
    const Request want = seen(Mode::mip, n, {131, 99, 110}, turn(52, {3, -2, 1}));
    const Scene scene;
    const Ask ask{want, scene};
    const Parameters by{{"step", 1.0}, {"leap", 127.0}};
    const auto with = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return made(distance_cast(), in, ask, by);
    };
    const Data one = with(1);
    for (const std::size_t threads : {2u, 7u}) expect_same(with(threads), one);
    const Offer offer = distance_cast().offer(in.what, ask, by);
    const Region box{{41, 13, 0}, {102, 66, 1}};
    Data part = Data::make(offer.to, box, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    distance_cast().run(offer, ask, in, part, box, context);
    for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y)
        ASSERT_EQ(
            0, std::memcmp(part.at<float>(41, y, 0), one.at<float>(41, y, 0), 61 * sizeof(float)));
}

TEST(DistanceCast, Refuses) {
    Representation what;
    what.extent = {30, 30, 30};
    Request want = seen(Mode::xray, what.extent, {40, 40, 40}, Matrix3d::Identity());
    const Scene scene;
    const auto refused = [&] {
        return distance_cast().offer(what, {want, scene}, {{"step", 1.0}, {"leap", 127.0}}).refused;
    };
    EXPECT_NE(refused().find("all samples"), std::string::npos);
    want.mode = mode_named("surface");
    EXPECT_NE(refused().find("mode surface"), std::string::npos);
    want.mode = Mode::mip;
    EXPECT_EQ(refused(), "");
    what.channels = 2;
    EXPECT_NE(refused().find("2 channels"), std::string::npos);
}

}  // namespace
}  // namespace edgewise
