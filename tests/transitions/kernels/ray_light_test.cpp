// Light on cast rays and gradients of samples, against plain loops in f64.
#include <gtest/gtest.h>

#include "tests/transitions/kernels/ray_cast_reference.hpp"
#include "transitions/kernels/gradient.hpp"

namespace edgewise::kernels {
namespace {

const std::vector<OpticsPoint> kColors = {
    {40, 0, {1, 0.3, 0.1}}, {120, 0.2, {0.2, 0.8, 0}}, {200, 0.7, {1, 1, 0.5}}};

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// [W93] EQ 51 as Foley and others (1990, 16.1) have it, by the vector of the mirrored light.
std::array<double, 2> phong(const Shading& shading, Vector normal, const Vector& eye) {
    const double length = std::sqrt(dot(normal, normal));
    std::array<double, 2> shares{shading.material.ambient, 0};
    if (length == 0) return shares;
    normal = 1 / length * normal;
    const double surface = std::min(1.0, length / shading.least);
    for (const Light& light : shading.lights) {
        const Vector towards{light.towards.x(), light.towards.y(), light.towards.z()};
        for (const Vector& side : {normal, -1 * normal}) {
            const double facing = dot(side, towards);
            if (facing <= 0) continue;
            // Edge on both sides are seen.
            const double seen = std::clamp(32 * dot(side, eye) + 0.5, 0.0, 1.0);
            const Vector mirrored = 2 * facing * side + -1 * towards;
            const double strength = seen * surface * light.intensity;
            shares[0] += strength * shading.material.diffuse * facing;
            shares[1] += strength * shading.material.specular *
                         std::pow(std::max(0.0, dot(mirrored, eye)), shading.material.exponent);
        }
    }
    return shares;
}

/// Derivatives by differences of `step` on either side.
Vector gradient_at(const Grid& volume, Hold hold, const Vector& p, double step) {
    Vector gradient;
    for (int axis = 0; axis < 3; ++axis) {
        Vector away{};
        away[axis] = step;
        Vector q = p;
        for (int i = 0; i < 3; ++i)
            q[i] = std::clamp(p[i], 0.0, static_cast<double>(volume.extent[i] - 1));
        gradient[axis] = volume.values.slope *
                         (sampled(volume, hold, q + away) - sampled(volume, hold, q + -1 * away)) /
                         (2 * step);
    }
    return gradient;
}

/// Random samples, smoothed, so that gradients turn slowly.
template <class T>
Volume<T> smooth_volume(const Extent& n, double low, double high, unsigned seed) {
    Volume<T> volume(n);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> phase(0, 6.28);
    std::array<Vector, 5> waves;
    std::array<double, 5> phases;
    for (int i = 0; i < 5; ++i) {
        waves[i] = {0.2 * std::cos(phase(random)), 0.2 * std::cos(phase(random)),
                    0.2 * std::cos(phase(random))};
        phases[i] = phase(random);
    }
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                double sum = 0;
                for (int i = 0; i < 5; ++i)
                    sum +=
                        std::sin(waves[i][0] * x + waves[i][1] * y + waves[i][2] * z + phases[i]);
                volume.at(x, y, z) =
                    static_cast<T>(low + (high - low) * std::clamp(0.5 + 0.2 * sum, 0.0, 1.0));
            }
    return volume;
}

Shading two_lights() {
    Shading shading{.by = Shade::phong, .least = 255e-4};
    shading.lights = {{Vec3(0, 0, -1), 0.6}, {Vec3(-0.6, -0.48, -0.64), 0.7}};
    shading.material = {0.15, 0.6, 0.25, 12.5};
    return shading;
}

struct Worst {
    double largest = 0, mean = 0;
};

/// @param step  of the reference's differences
Worst worst_of(RayCast cast, const Shading& shading, const Eigen::Matrix3d& to_screen, double step,
               int pixels) {
    const RayLight light = ray_light_of(shading, to_screen, cast.volume.values);
    const Optics optics = optics_of(kColors, 0.8, cast.volume.values);
    cast.light = &light;
    cast.optics = &optics;
    cast.rule = Combine::over;
    std::vector<float> picture(pixels * pixels * 4, -77.0f);
    ray_cast(cast, 0, 0, pixels, pixels, picture.data(), pixels * 4);
    const LitAt lit = [&](const Vector& p, const Vector& eye) {
        const Vector g = gradient_at(cast.volume, cast.hold, p, step);
        const Vec3 seen = to_screen * Vec3(g[0], g[1], g[2]);
        return phong(shading, {seen.x(), seen.y(), seen.z()}, eye);
    };
    Worst worst;
    for (int y = 0; y < pixels; ++y)
        for (int x = 0; x < pixels; ++x) {
            const auto want = reference(cast, kColors, 0.8, x, y, lit);
            for (int c = 0; c < 4; ++c) {
                const double off = std::abs(picture[(y * pixels + x) * 4 + c] - want[c]);
                worst.largest = std::max(worst.largest, off);
                worst.mean += off / (4.0 * pixels * pixels);
            }
        }
    return worst;
}

/// Values of samples that are read with 14 bits are off by 3 / 32768 of 255, half of their
/// differences likewise. That turns the normal of a gradient of 1 a sample by 0.023, and light that
/// goes with its cosine's power of 12 by as much.
constexpr double kLargest = 3e-2, kMean = 5e-4;

TEST(RayLight, IsThatOfPlainLoopsForAllTypes) {
    const Extent n{21, 17, 26};
    // Screen axes of rays turned by these angles; input steps of which one is longer.
    Eigen::Matrix3d to_screen;
    to_screen << 0.8, 0.1, 0, -0.2, 0.9, 0.3, 0.1, -0.3, 0.7;
    const auto check = [&](const Grid& grid, Hold hold) {
        for (const double step : {0.8, 0.5}) {
            RayCast cast{
                .volume = grid, .hold = hold, .rays = turned(n, 0.4, -0.7, 29), .step = step};
            const double h = hold == Hold::foh ? 1 : 1e-3;
            const Worst worst = worst_of(cast, two_lights(), to_screen, h, 29);
            EXPECT_LT(worst.largest, kLargest) << static_cast<int>(hold);
            EXPECT_LT(worst.mean, kMean) << static_cast<int>(hold);
        }
    };
    for (const Hold hold : {Hold::foh, Hold::bspline3}) {
        const auto u8 = smooth_volume<std::uint8_t>(n, 0, 255, 1);
        check(u8.grid(Type::u8), hold);
        const auto i16 = smooth_volume<std::int16_t>(n, -32000, 32000, 2);
        check(i16.grid(Type::i16, {-1 / 257.0, 128}), hold);
        const auto f32 = smooth_volume<float>(n, 0, 255, 3);
        check(f32.grid(Type::f32), hold);
        const auto f64 = smooth_volume<double>(n, 0, 255, 4);
        check(f64.grid(Type::f64), hold);
    }
}

TEST(RayLight, FromAnEyeHighlightsFollowEachRay) {
    const Extent n{21, 17, 26};
    const auto volume = smooth_volume<float>(n, 0, 255, 5);
    const Eigen::Matrix3d to_screen = Eigen::Matrix3d::Identity();
    RayCast cast{.volume = volume.grid(Type::f32), .rays = from_eye(n, 27, 30), .step = 0.6};
    Shading shading = two_lights();
    const Worst worst = worst_of(cast, shading, to_screen, 1, 27);
    EXPECT_LT(worst.largest, kLargest);
    EXPECT_LT(worst.mean, kMean);
}

TEST(RayLight, TakesGradientsThatWereMadeBefore) {
    const Extent n{21, 17, 26};
    const auto volume = smooth_volume<std::uint8_t>(n, 0, 255, 6);
    const Grid grid = volume.grid(Type::u8);
    Gradients made{.samples = Array(n.samples() * 8, std::pmr::get_default_resource()),
                   .scale = gradient_scale(0, 255)};
    gradient_slices(grid, Differences::central, made.scale, 0, n.z,
                    static_cast<std::int16_t*>(made.samples.data()));
    RayCast cast{.volume = grid, .rays = turned(n, 0.4, -0.7, 29), .step = 0.5};
    cast.gradients = &made;
    const Worst worst = worst_of(cast, two_lights(), Eigen::Matrix3d::Identity(), 1, 29);
    EXPECT_LT(worst.largest, kLargest);
    EXPECT_LT(worst.mean, kMean);
}

TEST(RayLight, OfFacetsIsThatOfTheShading) {
    // One opaque slope: each pixel shows one sample, of one normal.
    const Extent n{16, 16, 16};
    Volume<float> volume(n);
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x)
                volume.at(x, y, z) = static_cast<float>(3 * x - 2 * y + 5 * z);
    const std::vector<OpticsPoint> opaque = {{-1000, 1, {0.5, 0.25, 1}}};
    const Optics optics = optics_of(opaque, 1, {});
    for (const Vec3& towards : {Vec3(0, 0, -1), Vec3(-0.3, 0.9, -0.3), Vec3(0.9, 0, 0.2)})
        for (const Shade by : {Shade::phong, Shade::torrance_sparrow}) {
            Shading shading{.by = by, .least = 1e-3};
            shading.lights = {{towards.normalized(), 0.8}};
            const RayLight light = ray_light_of(shading, Eigen::Matrix3d::Identity(), {});
            RayCast cast{.volume = volume.grid(Type::f32), .rule = Combine::over};
            cast.rays.origin = {{0, 0, -5}, {1, 0, 0}, {0, 1, 0}};
            cast.rays.direction.base = {0, 0, 1};
            cast.optics = &optics;
            cast.light = &light;
            std::vector<float> picture(16 * 16 * 4);
            ray_cast(cast, 0, 0, 16, 16, picture.data(), 16 * 4);
            // The outermost samples continue, so at the near face only half of z's slope is left.
            const Lit lit = shading.at(Vec3(3, -2, 2.5), Vec3(0, 0, -1));
            const float* pixel = picture.data() + 4 * (7 * 16 + 7);
            EXPECT_NEAR(pixel[0], 0.5 * lit.diffuse + lit.specular, 2e-6);
            EXPECT_NEAR(pixel[2], lit.diffuse + lit.specular, 2e-6);
        }
}

/// A polynomial of each axis, and its derivative there.
double quartic(double x) { return 0.1 + x * (0.3 + x * (-0.2 + x * (0.05 - 0.004 * x))); }
double slope(double x) { return 0.3 + x * (-0.4 + x * (0.15 - 0.016 * x)); }

TEST(Gradients, AreExactToTheirOrder) {
    const Extent n{9, 8, 7};
    Volume<double> quadratic(n), fourth(n);
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                quadratic.at(x, y, z) = double(x * x) - 2.0 * double(y) + 0.5 * double(z * z);
                fourth.at(x, y, z) =
                    quartic(double(x)) + 2 * quartic(double(y)) - quartic(double(z));
            }
    std::vector<std::int16_t> made(4 * n.samples());
    const auto at = [&](const Volume<double>& volume, Differences by, float scale) {
        gradient_slices(volume.grid(Type::f64), by, scale, 0, n.z, made.data());
        const std::int16_t* g = made.data() + 4 * ((3 * n.y + 4) * n.x + 5);
        return Vector{scale * g[0], scale * g[1], scale * g[2]};
    };
    for (const Differences by : {Differences::central, Differences::sobel}) {
        const Vector g = at(quadratic, by, 1e-3f);
        EXPECT_NEAR(g[0], 10, 1e-3);
        EXPECT_NEAR(g[1], -2, 1e-3);
        EXPECT_NEAR(g[2], 3, 1e-3);
    }
    const Vector g = at(fourth, Differences::fourth, 1e-4f);
    EXPECT_NEAR(g[0], slope(5), 1e-4);
    EXPECT_NEAR(g[1], 2 * slope(4), 1e-4);
    EXPECT_NEAR(g[2], -slope(3), 1e-4);
}

TEST(Gradients, PassOverSamplesThatAreNotFinite) {
    const Extent n{4, 3, 3};
    Volume<float> volume(n);
    for (std::int64_t i = 0; i < n.samples(); ++i) volume.samples[i] = static_cast<float>(i % 4);
    volume.at(2, 1, 1) = std::numeric_limits<float>::quiet_NaN();
    std::vector<std::int16_t> made(4 * n.samples());
    gradient_slices(volume.grid(Type::f32), Differences::central, 0.01f, 0, n.z, made.data());
    const auto along = [&](std::int64_t x) { return made[4 * ((1 * n.y + 1) * n.x + x)]; };
    EXPECT_EQ(along(0), 50) << "the outermost sample continues";
    EXPECT_EQ(along(1), 50) << "its own value stands for the missing one";
    EXPECT_EQ(along(2), 100) << "its neighbours are there";
    EXPECT_EQ(along(3), 0);
}

}  // namespace
}  // namespace edgewise::kernels
