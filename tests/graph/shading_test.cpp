#include "graph/shading.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

namespace edgewise {
namespace {

const Vec3 kEye(0, 0, -1);

Vec3 direction(double down, double around) {
    return {std::sin(down) * std::cos(around), std::sin(down) * std::sin(around), -std::cos(down)};
}

TEST(Shading, OfASurfaceThatFacesTheHeadLightIsAllOfTheMaterial) {
    const Shading shading{.by = Shade::phong, .least = 1e-3};
    for (const double sign : {1.0, -1.0}) {
        const Lit lit = shading.at(Vec3(0, 0, sign * 7), kEye);
        EXPECT_DOUBLE_EQ(lit.diffuse, 0.1 + 0.7);
        EXPECT_DOUBLE_EQ(lit.specular, 0.2);
    }
}

TEST(Shading, FollowsTheCosines) {
    const Shading shading{.by = Shade::phong, .least = 1e-3};
    for (const double degrees : {10.0, 30.0, 44.0, 60.0, 89.0}) {
        const double angle = degrees * std::numbers::pi / 180;
        const Lit lit = shading.at(5 * direction(angle, 1.1), kEye);
        EXPECT_NEAR(lit.diffuse, 0.1 + 0.7 * std::cos(angle), 1e-12);
        // The mirrored light is twice as far away.
        EXPECT_NEAR(lit.specular, 0.2 * std::pow(std::max(0.0, std::cos(2 * angle)), 10), 1e-12);
    }
}

TEST(Shading, WithoutASurfaceIsAmbient) {
    const Shading shading{.by = Shade::phong, .least = 2};
    EXPECT_EQ(shading.at(Vec3::Zero(), kEye).diffuse, 0.1);
    EXPECT_EQ(shading.at(Vec3(NAN, 0, 0), kEye).diffuse, 0.1);
    // Half of the least length: half of the light.
    EXPECT_DOUBLE_EQ(shading.at(Vec3(0, 0, 1), kEye).diffuse, 0.1 + 0.5 * 0.7);
    EXPECT_DOUBLE_EQ(shading.at(Vec3(0, 0, 1), kEye).specular, 0.5 * 0.2);
}

TEST(Shading, LightsAddUpAndNoneShinesFromBehind) {
    Shading shading{.by = Shade::phong, .least = 1e-3};
    const Vec3 left = direction(0.6, 0), right = direction(0.9, 2);
    const auto by = [&](std::vector<Light> lights) {
        shading.lights = std::move(lights);
        return shading.at(direction(0.3, 0.5), kEye);
    };
    const Lit a = by({{left, 0.5}}), b = by({{right, 0.25}}),
              both = by({{left, 0.5}, {right, 0.25}});
    EXPECT_NEAR(both.diffuse, a.diffuse + b.diffuse - 0.1, 1e-12);
    EXPECT_NEAR(both.specular, a.specular + b.specular, 1e-12);
    const Lit behind = by({{Vec3(0, 0, 1), 1}});
    EXPECT_EQ(behind.diffuse, 0.1);
    EXPECT_EQ(behind.specular, 0);
}

TEST(Shading, DoesNotJumpWhereASurfaceIsSeenEdgeOn) {
    // A light from the side: one side of the surface is lit, the other one is dark.
    for (const Shade by : {Shade::phong, Shade::torrance_sparrow}) {
        Shading shading{.by = by, .least = 1e-9};
        shading.lights = {{direction(0.7, 0.2), 1}};
        const auto at = [&](double normal) {
            const Lit lit = shading.at(direction(normal, 0), kEye);
            return lit.diffuse + lit.specular;
        };
        const double right = std::numbers::pi / 2, step = 1e-4;
        // Shares run from 0 to 1 over a cosine of 2 kEdgeOn; what is sent changes 100 times less.
        const double most = 1.01 * step / (2 * Shading::kEdgeOn);
        double lit = 0, dark = 1;
        for (double normal = right - 0.05; normal < right + 0.05; normal += step) {
            EXPECT_NEAR(at(normal), at(normal + step), most) << normal;
            lit = std::max(lit, at(normal));
            dark = std::min(dark, at(normal));
        }
        EXPECT_GT(lit, 0.5);
        EXPECT_DOUBLE_EQ(dark, 0.1);
        EXPECT_DOUBLE_EQ(at(right - 0.02), at(right - 0.02 + std::numbers::pi));
    }
}

TEST(Shading, SendsNoMoreThanFallsOnIt) {
    for (const Shade by : {Shade::phong, Shade::torrance_sparrow}) {
        Shading shading{.by = by, .least = 1e-9};
        for (const double exponent : {1.0, 10.0, 200.0})
            for (double light = 0; light < 3.1; light += 0.21)
                for (double normal = 0; normal < 1.57; normal += 0.13)
                    for (double around = 0; around < 6.2; around += 0.31) {
                        shading.material.exponent = exponent;
                        shading.lights = {{direction(light, 0), 1}};
                        const Lit lit = shading.at(direction(normal, around), kEye);
                        EXPECT_LE(lit.diffuse + lit.specular, 1 + 1e-12);
                        EXPECT_GE(lit.specular, 0);
                    }
    }
}

TEST(Shading, FacetsAreBrightestWhereTheyFaceLightAndEye) {
    Shading shading{.by = Shade::torrance_sparrow, .least = 1e-9};
    shading.material.exponent = 50;
    EXPECT_NEAR(shading.at(kEye, kEye).specular, 0.2, 1e-12);
    double before = 1;
    for (double away = 0; away < 0.6; away += 0.05) {
        const double here = shading.at(direction(away, 0), kEye).specular;
        EXPECT_LT(here, before);
        before = here;
    }
    EXPECT_LT(before, 0.2 * 0.02);
}

TEST(Shading, ParticlesScatterAllTheirLightSomewhere) {
    // 4 pi times the phase function, whose mean over the sphere is 1 and whose mean cosine is g.
    for (const double g : {-0.9, -0.3, 0.0, 0.5, 0.8}) {
        constexpr int kParts = 200000;
        double whole = 0, forward = 0;
        for (int i = 0; i < kParts; ++i) {
            const double cosine = -1 + (i + 0.5) * 2 / kParts;
            whole += phase_of(g, cosine) / kParts;
            forward += cosine * phase_of(g, cosine) / kParts;
        }
        EXPECT_NEAR(whole, 1, 1e-6) << g;
        EXPECT_NEAR(forward, g, 1e-6) << g;
    }
}

TEST(Shading, ParticlesDoNotAskForAGradient) {
    Shading shading{.by = Shade::particles};
    shading.phase = 0.4;
    shading.lights = {{Vec3(0, 0, -1), 0.5}, {Vec3(1, 0, 0), 2}};
    // The light at the eye is turned back, the one from the side by a right angle.
    const double expected = 0.5 * phase_of(0.4, -1) + 2 * phase_of(0.4, 0);
    for (const Vec3& gradient : {Vec3(0, 0, 0), Vec3(1, 2, 3)}) {
        const Lit lit = shading.at(gradient, Vec3(0, 0, -1));
        EXPECT_NEAR(lit.diffuse, expected, 1e-15);
        EXPECT_EQ(lit.specular, 0);
    }
    EXPECT_FALSE(shading.has_normals());
}

TEST(Shading, OfSumsAddsWhatGradientsSend) {
    Shading shading{.by = Shade::hemisphere};
    shading.material = {0.3, 0.8, 0.5, 10};
    shading.lights = {{Vec3(0, 0, -1), 0.5}, {Vec3(1, 0, 0), 2}};
    EXPECT_TRUE(shading.of_sums() && shading.has_normals());
    const Vec3 gradient(-3, 0, 4);  // falls towards +x and -z
    // Cosines 0.8 and 0.6, of a gradient of length 5; whatever the side of the eye.
    for (const Vec3& eye : {Vec3(0, 0, -1), Vec3(0, 0, 1)}) {
        Lit lit = shading.at(gradient, eye);
        EXPECT_DOUBLE_EQ(lit.diffuse, 0.3);
        EXPECT_DOUBLE_EQ(lit.specular, 0.8 * 5 * (0.5 * 1.8 / 2 + 2 * 1.6 / 2));
        shading.by = Shade::lambert;
        lit = shading.at(gradient, eye);
        EXPECT_DOUBLE_EQ(lit.specular, 0.8 * 5 * (0.5 * 0.8 + 2 * 0.6));
        EXPECT_DOUBLE_EQ(shading.at(-gradient, eye).specular, 0);
        shading.by = Shade::hemisphere;
        EXPECT_DOUBLE_EQ(shading.at(-gradient, eye).specular,
                         0.8 * 5 * (0.5 * 0.2 / 2 + 2 * 0.4 / 2));
    }
    EXPECT_EQ(shading.at(Vec3::Zero(), Vec3(0, 0, -1)).specular, 0);
    EXPECT_EQ(shading.at(Vec3(0, INFINITY, 0), Vec3(0, 0, -1)).specular, 0);
}

TEST(Shading, RulesHaveNames) {
    for (const Shade by : {Shade::none, Shade::phong, Shade::torrance_sparrow, Shade::particles,
                           Shade::hemisphere, Shade::lambert})
        EXPECT_NE(name_of(by), "?");
}

TEST(Shading, LightFallsOffWithDepth) {
    const DepthCue by_exponent{0.5, false}, by_line{0.25, true};
    EXPECT_DOUBLE_EQ(by_exponent.left(0), 1);
    EXPECT_DOUBLE_EQ(by_exponent.left(3), std::exp(-1.5));
    EXPECT_DOUBLE_EQ(by_line.left(3), 0.25);
    EXPECT_DOUBLE_EQ(by_line.left(5), 0);
}

}  // namespace
}  // namespace edgewise
