#include "reference/phantoms.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "graph/errors.hpp"

namespace edgewise {
namespace {

TEST(Phantoms, AreTheThesisSphereAndCube) {
    const Phantom sphere = phantom_named("sphere", 128), cube = phantom_named("cube", 128);
    EXPECT_EQ(sphere.at({63.5, 63.5, 63.5}), 1);
    EXPECT_DOUBLE_EQ(sphere.at({63.5 + 8, 63.5, 63.5}), 0.75);
    EXPECT_EQ(sphere.at({63.5, 63.5 + 32, 63.5}), 0);
    EXPECT_EQ(cube.at({32, 95, 60}), 1);  // the outermost samples, 31.5 from the centre
    EXPECT_EQ(cube.at({31.99, 60, 60}), 0);
    EXPECT_EQ(cube.at({95.01, 60, 60}), 0);
}

TEST(Phantoms, FollowTheirFormulas) {
    std::mt19937 bits(1);
    std::uniform_real_distribution<double> uniform(0, 63);
    const Phantom lobb = phantom_named("marschner-lobb", 64);
    const Phantom head = phantom_named("shepp-logan", 64);
    const Phantom plate = phantom_named("zone-plate", 64);
    for (int i = 0; i < 200; ++i) {
        const Vec3 p(uniform(bits), uniform(bits), uniform(bits));
        const double x = (p.x() - 31.5) / 32, y = (p.y() - 31.5) / 32, z = (p.z() - 31.5) / 32;
        const double ring = std::cos(12 * std::numbers::pi *
                                     std::cos(std::numbers::pi * std::sqrt(x * x + y * y) / 2));
        EXPECT_NEAR(lobb.at(p), (1 - std::sin(std::numbers::pi * z / 2) + 0.25 * (1 + ring)) / 2.5,
                    1e-13);
        const double r2 = std::pow(p.x() - 31.5, 2) + std::pow(p.y() - 31.5, 2);
        EXPECT_NEAR(plate.at(p), 0.5 + 0.5 * std::cos(std::numbers::pi * 0.8 * r2 / 64), 1e-12);
        if (std::hypot(x / .69, y / .92, z / .81) > 1) {
            EXPECT_EQ(head.at(p), 0);
        }
    }
    EXPECT_EQ(head.at({31.5, 31.5 - 0.9 * 32, 31.5}), 1);  // within the skull
    EXPECT_NEAR(head.at({31.5, 31.5 + 0.35 * 32, 31.5 - 0.15 * 32}), 0.3, 1e-12);
    const Phantom checker = phantom_named("checker", 64);
    EXPECT_EQ(checker.at({0, 0, 0}), 0);
    EXPECT_EQ(checker.at({8, 0, 0}), 1);
    EXPECT_EQ(checker.at({8, 15, 9}), 0);
}

TEST(Phantoms, StayWithinZeroAndOneAndVary) {
    for (const std::string& name : phantom_names()) {
        const Data data = make_phantom(name, 40, std::pmr::get_default_resource());
        const Phantom phantom = phantom_named(name, 40);
        EXPECT_EQ(data.what.axes, phantom.axes);
        EXPECT_EQ(data.what.extent, (Extent{40, 40, phantom.axes == 3 ? 40 : 1}));
        double low = 2, high = -1;
        for (std::int64_t i = 0; i < data.what.samples(); ++i) {
            const Vec3 p(static_cast<double>(i % 40), static_cast<double>(i / 40 % 40),
                         static_cast<double>(i / 1600));
            const double value = static_cast<double>(data.as<float>()[i]);
            ASSERT_EQ(value, static_cast<double>(static_cast<float>(phantom.at(p)))) << name;
            low = std::min(low, value);
            high = std::max(high, value);
        }
        EXPECT_GE(low, 0) << name;
        EXPECT_LE(high, 1) << name;
        EXPECT_GT(high - low, 0.3) << name;
    }
}

TEST(Phantoms, RefuseWhatTheyAreNot) {
    EXPECT_THROW(phantom_named("teapot", 8), RequestError);
    EXPECT_THROW(phantom_named("sphere", 0), RequestError);
}

}  // namespace
}  // namespace edgewise
