#include "transitions/kernels/ray_cast_quadratures.hpp"

#include <gtest/gtest.h>

#include "tests/transitions/kernels/ray_cast_reference.hpp"
#include "transitions/filters/filter.hpp"

namespace edgewise::kernels {
namespace {

constexpr int kSide = 64;

/// Without bricks, and with those that an edge makes.
/// @return whether anything is seen
bool expect_same_bytes(RayCast cast, const Filter& filter, bool quadratic) {
    const TransferSums sums = transfer_sums_of(*cast.optics);
    const auto picture = [&] {
        std::vector<float> made(4 * kSide * kSide);
        if (quadratic)
            ray_cast_quadratic(cast, sums, 0, 0, kSide, kSide, made.data(), 4 * kSide);
        else
            ray_cast_trapezoid(cast, 0, 0, kSide, kSide, made.data(), 4 * kSide);
        return made;
    };
    cast.hold = hold_of(filter);
    cast.weights = &TapPolynomials::of(filter);
    Taken without, with;
    cast.taken = &without;
    const std::vector<float> plain = picture();
    LevelsOf of{.optics = cast.optics, .overshoot = overshoot_of(filter, 3)};
    if (quadratic) of.overshoot = beyond_quadratic(of.overshoot);
    Bricks bricks(cast.volume.extent, std::pmr::get_default_resource());
    bricks.least.resize(bricks.level.size());
    brick_layers(cast.volume, of, 0, bricks.extent.z, bricks);
    join_layers(cast.volume, of, 0, bricks.extent.y, bricks);
    cast.bricks = &bricks;
    cast.taken = &with;
    const std::vector<float> skipped = picture();
    EXPECT_EQ(0, std::memcmp(plain.data(), skipped.data(), plain.size() * sizeof(float)))
        << filter.name << ' ' << cast.step << ' ' << quadratic;
    EXPECT_LE(with.samples, without.samples);
    return *std::max_element(plain.begin(), plain.end()) > 0;
}

/// A quadratic through samples below a band may reach into it.
TEST(RayCastQuadratures, BricksChangeNoByte) {
    const Extent n{45, 38, 51};
    auto volume = random_volume<float>(n, 0, 0.5, 5);
    std::mt19937 random(17);
    for (int spot = 0; spot < 60; ++spot)
        volume.at(random() % n.x, random() % n.y, random() % n.z) = 20.0f + 2 * spot;
    volume.at(7, 8, 12) = std::numeric_limits<float>::quiet_NaN();
    volume.at(8, 8, 12) = std::numeric_limits<float>::infinity();
    const std::vector<OpticsPoint> band = {
        {30, 0, {1, 1, 1}}, {31, 0.5, {1, 0, 1}}, {32, 0, {1, 1, 1}}};
    int pictures = 0;
    for (const ValueMap& values : {ValueMap{}, ValueMap{-1, 60}})
        for (const Filter& filter : filters()) {
            if (filter.taps > 4) continue;
            const Optics optics = optics_of(band, 1, values);
            for (const double step : {1.0, 0.4, 2.9})
                for (const Rays& rays : {turned(n, 0.6, 0.4, kSide), from_eye(n, kSide, 55)})
                    for (const bool quadratic : {false, true})
                        pictures += expect_same_bytes({.volume = volume.grid(Type::f32, values),
                                                       .rule = Combine::over,
                                                       .rays = rays,
                                                       .step = step,
                                                       .optics = &optics},
                                                      filter, quadratic);
        }
    EXPECT_GT(pictures, 50);
}

/// Four samples of 0, 0, 1, 1 along a ray: the quadratic through 0, 0 and 1 goes to -1/8, and the
/// one through 0, 1 and 1 to 9/8. A picture of values beyond 0 and 1 has light from there alone.
TEST(RayCastQuadratures, SeeWhereAQuadraticGoesBeyondSamples) {
    const Extent n{4, 4, 16};
    Volume<float> volume(n);
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) volume.at(x, y, z) = z < 8 ? 0.0f : 1.0f;
    Rays rays;  // screen z from the first face on; pixels are voxels
    rays.origin = {.base = {0, 0, -0.5}, .x = {1, 0, 0}, .y = {0, 1, 0}};
    rays.direction.base = {0, 0, 1};
    const Optics optics =
        optics_of(std::vector<OpticsPoint>{{1.05, 0, {1, 1, 1}}, {1.06, 0.9, {1, 1, 1}}}, 1, {});
    const TransferSums sums = transfer_sums_of(optics);
    std::array<float, 4> made{};
    const RayCast cast{.volume = volume.grid(Type::f32),
                       .rule = Combine::over,
                       .rays = rays,
                       .step = 2,
                       .optics = &optics};
    // Middles of cells at z = 0.5, 2.5, ..., 6.5, 8.5: between the last two 7.5 has the value 1/2.
    ray_cast_quadratic(cast, sums, 1, 1, 1, 1, made.data(), 4);
    EXPECT_EQ(made[3], 0);
    // Moved by half a voxel, at 7 and 9 with 8 between: the values are 0, 1 and 1.
    RayCast moved = cast;
    moved.rays.origin.base[2] = 0;
    ray_cast_quadratic(moved, sums, 1, 1, 1, 1, made.data(), 4);
    EXPECT_GT(made[3], 0.1f);
    ray_cast_trapezoid(moved, 1, 1, 1, 1, made.data(), 4);
    EXPECT_EQ(made[3], 0);
}

}  // namespace
}  // namespace edgewise::kernels
