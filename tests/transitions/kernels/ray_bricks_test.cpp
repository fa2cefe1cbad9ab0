#include <gtest/gtest.h>

#include "tests/transitions/kernels/ray_cast_reference.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/transfer_integrals.hpp"

namespace edgewise::kernels {
namespace {

/// A volume that is mostly empty, with small bright and narrow-band spots, some at brick borders.
Volume<float> spotted(const Extent& n) {
    Volume<float> volume(n);
    std::mt19937 random(17);
    for (int spot = 0; spot < 60; ++spot)
        volume.at(random() % n.x, random() % n.y, random() % n.z) = 40.0f + 7 * spot;
    volume.at(7, 8, 12) = std::numeric_limits<float>::quiet_NaN();
    volume.at(8, 8, 12) = std::numeric_limits<float>::infinity();
    return volume;
}

Bricks bricks_for(const RayCast& cast, const Filter& filter) {
    const LevelsOf of{.optics = cast.rule == Combine::over ? cast.optics : nullptr,
                      .overshoot = overshoot_of(filter, 3)};
    Bricks bricks(cast.volume.extent, std::pmr::get_default_resource());
    bricks.least.resize(bricks.level.size());
    // In two calls, as threads would.
    const std::int64_t layers = bricks.extent.z / 3, lines = bricks.extent.y / 3;
    brick_layers(cast.volume, of, layers, bricks.extent.z, bricks);
    brick_layers(cast.volume, of, 0, layers, bricks);
    join_layers(cast.volume, of, lines, bricks.extent.y, bricks);
    join_layers(cast.volume, of, 0, lines, bricks);
    return bricks;
}

/// @return samples taken without bricks and with them
std::array<std::int64_t, 2> expect_same_bytes(RayCast cast, const Filter& filter) {
    const int channels = cast.rule == Combine::max ? 1 : 4;
    std::vector<float> plain(64 * 64 * channels), skipped(plain.size());
    Taken without, with;
    cast.hold = hold_of(filter);
    cast.weights = &TapPolynomials::of(filter);
    cast.taken = &without;
    ray_cast(cast, 0, 0, 64, 64, plain.data(), 64 * channels);
    const Bricks bricks = bricks_for(cast, filter);
    cast.bricks = &bricks;
    cast.taken = &with;
    ray_cast(cast, 0, 0, 64, 64, skipped.data(), 64 * channels);
    EXPECT_EQ(0, std::memcmp(plain.data(), skipped.data(), plain.size() * sizeof(float)))
        << filter.name << ' ' << cast.step;
    return {without.samples, with.samples};
}

// Opaque in a narrow band only: values at both ends of a brick's range are transparent.
const std::vector<OpticsPoint> kBand = {
    {30, 0, {1, 1, 1}}, {31, 0.5, {1, 0, 1}}, {32, 0, {1, 1, 1}}};

template <class T>
void bricks_change_no_byte(const Volume<T>& volume, Type type) {
    const Extent& n = volume.extent;
    for (const ValueMap& values : {ValueMap{}, ValueMap{-1, 60}})
        for (const Filter& filter : filters()) {
            if (!filter.positive) continue;
            for (const double step : {1.0, 0.21, 2.9, 7.3})
                for (const Rays& rays :
                     {turned(n, 0.6, 0.4, 64), turned(n, 0, 0, 64), from_eye(n, 64, 55)})
                    for (const Combine rule : {Combine::max, Combine::over, Combine::hit}) {
                        const Optics optics = optics_of(kBand, 1, values);
                        expect_same_bytes({.volume = volume.grid(type, values),
                                           .rule = rule,
                                           .rays = rays,
                                           .step = step,
                                           .level = 31,
                                           .optics = &optics},
                                          filter);
                        if (testing::Test::HasFailure()) return;
                    }
        }
}

/// Spikes of both signs over a faint noise: what negative weights make of them lies beyond. They
/// are few, so that bricks between them are left out by packets of 16 rays as well.
template <class T>
Volume<T> spiked(const Extent& n) {
    auto volume = random_volume<T>(n, -3, 3, 5);
    std::mt19937 random(29);
    for (int spike = 0; spike < 12; ++spike)
        volume.at(random() % n.x, random() % n.y, random() % n.z) =
            static_cast<T>((spike % 2 ? -1 : 1) * (40 + 30 * spike));
    for (std::int64_t y = 8; y < 12; ++y)  // a whole row of bricks below zero, beside its opposite
        for (std::int64_t z = 8; z < 12; ++z)
            for (std::int64_t x = 0; x < n.x; ++x)
                volume.at(x, y, z) = static_cast<T>(x < 16 ? -300 : 300);
    return volume;
}

template <class T>
void negative_weights_change_no_byte(Type type) {
    const Extent n{45, 38, 51};
    const Volume<T> volume = spiked<T>(n);
    for (const ValueMap& values : {ValueMap{}, ValueMap{-1, 60}})
        for (const Filter& filter : filters()) {
            if (filter.positive) continue;
            std::int64_t without = 0, with = 0;
            for (const double step : {1.0, 2.9})
                for (const Rays& rays : {turned(n, 0.6, 0.4, 64), from_eye(n, 64, 55)})
                    for (const Combine rule : {Combine::max, Combine::over, Combine::hit}) {
                        const Optics optics = optics_of(kBand, 1, values);
                        const auto taken = expect_same_bytes({.volume = volume.grid(type, values),
                                                              .rule = rule,
                                                              .rays = rays,
                                                              .step = step,
                                                              .level = 31,
                                                              .optics = &optics},
                                                             filter);
                        // The level lies everywhere in the noise.
                        if (rule == Combine::hit) continue;
                        without += taken[0];
                        with += taken[1];
                    }
            EXPECT_LT(static_cast<double>(with), 0.9 * static_cast<double>(without)) << filter.name;
        }
}

/// The largest of each brick and its neighbours, sample by sample.
template <class T>
void bricks_hold_largest(Type type, const Extent& n) {
    const auto volume = random_volume<T>(n, std::is_signed_v<T> ? -100 : 0, 100, 8);
    for (const double slope : {1.0, -1.0}) {
        Bricks bricks(n, std::pmr::get_default_resource());
        const Grid grid = volume.grid(type, {slope, 0});
        brick_layers(grid, {}, 0, bricks.extent.z, bricks);
        join_layers(grid, {}, 0, bricks.extent.y, bricks);
        std::vector<float> largest(bricks.level.size(), -kInfinity);
        const auto reached = [](std::int64_t at, std::int64_t bricks_along, const auto& use) {
            for (std::int64_t b = std::max<std::int64_t>(at / 4 - 1, 0);
                 b <= std::min(at / 4 + 1, bricks_along - 1); ++b)
                use(b);
        };
        for (std::int64_t i = 0; i < n.samples(); ++i)
            reached(i / (n.x * n.y), bricks.extent.z, [&](std::int64_t k) {
                reached(i / n.x % n.y, bricks.extent.y, [&](std::int64_t j) {
                    reached(i % n.x, bricks.extent.x, [&](std::int64_t b) {
                        float& level = largest[(k * bricks.extent.y + j) * bricks.extent.x + b];
                        level = std::max(level, static_cast<float>(slope * volume.samples[i]));
                    });
                });
            });
        for (std::size_t i = 0; i < largest.size(); ++i)
            ASSERT_EQ(bricks.level[i], largest[i]) << n.x << ' ' << slope << ' ' << i;
    }
}

TEST(RayCast, BricksHoldTheLargestAround) {
    for (const std::int64_t x : {1, 3, 16, 64, 67, 141}) {
        bricks_hold_largest<std::uint8_t>(Type::u8, {x, 9, 13});
        bricks_hold_largest<std::int8_t>(Type::i8, {x, 9, 13});
        bricks_hold_largest<std::uint16_t>(Type::u16, {x, 9, 13});
        bricks_hold_largest<std::int16_t>(Type::i16, {x, 1, 5});
        bricks_hold_largest<float>(Type::f32, {x, 9, 1});
        bricks_hold_largest<std::int32_t>(Type::i32, {x, 5, 13});
        bricks_hold_largest<double>(Type::f64, {x, 5, 13});
    }
}

TEST(RayCast, BricksChangeNoByte) {
    const Extent n{45, 38, 51};
    const auto floats = spotted(n);
    bricks_change_no_byte(floats, Type::f32);
    Volume<std::uint8_t> bytes(n);  // lanes read them in another way, at the ends too
    for (std::int64_t i = 0; i < n.samples(); ++i) {
        const float value = floats.samples[i];
        bytes.samples[i] = std::isfinite(value) ? static_cast<std::uint8_t>(value / 2) : 255;
    }
    bricks_change_no_byte(bytes, Type::u8);
    // The largest at the far faces, beside numbers whose difference a float cannot hold.
    Volume<std::int16_t> words(n);
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x)
                words.at(x, y, z) = y == n.y - 1 || z == n.z - 1
                                        ? std::int16_t{32767}
                                        : static_cast<std::int16_t>(-6000 - (x * 37 + z) % 211);
    bricks_change_no_byte(words, Type::i16);
}

TEST(RayCast, BricksChangeNoByteWhereWeightsAreNegative) {
    negative_weights_change_no_byte<float>(Type::f32);
    negative_weights_change_no_byte<std::int16_t>(Type::i16);
}

/// Between two bricks of one value each lie all values between the two.
TEST(RayCast, BricksSeeWhatLiesBetweenThem) {
    const Extent n{40, 40, 40};
    Volume<float> volume(n);
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) volume.at(x, y, z) = x < 20 ? 0 : 100;
    const Optics optics = optics_of(kBand, 1, {});
    for (const Filter& filter : filters())
        for (const Rays& rays : {turned(n, 0.2, 1.4, 64), from_eye(n, 64, 55)}) {
            const auto taken = expect_same_bytes({.volume = volume.grid(Type::f32),
                                                  .rule = Combine::over,
                                                  .rays = rays,
                                                  .step = 0.02,
                                                  .optics = &optics},
                                                 filter);
            EXPECT_LT(taken[1], taken[0]) << filter.name;
        }
}

/// Pieces between samples see a band that lies between them.
TEST(RayCast, BricksChangeNoByteOfPiecesBetweenSamples) {
    const Extent n{45, 38, 51};
    const auto volume = spotted(n);
    std::int64_t without = 0, with = 0;
    for (const ValueMap& values : {ValueMap{}, ValueMap{-1, 60}}) {
        const Optics optics = optics_of(kBand, 1, values);
        const TransferIntegrals integrals = transfer_integrals_of(optics);
        for (const Filter& filter : filters()) {
            if (!filter.positive) continue;
            for (const double step : {1.0, 0.21, 2.9, 7.3})
                for (const Rays& rays :
                     {turned(n, 0.6, 0.4, 64), turned(n, 0, 0, 64), from_eye(n, 64, 55)}) {
                    const auto taken = expect_same_bytes({.volume = volume.grid(Type::f32, values),
                                                          .rule = Combine::over,
                                                          .rays = rays,
                                                          .step = step,
                                                          .optics = &optics,
                                                          .integrals = &integrals},
                                                         filter);
                    without += taken[0];
                    with += taken[1];
                }
        }
    }
    EXPECT_LT(with, without);
}

}  // namespace
}  // namespace edgewise::kernels
