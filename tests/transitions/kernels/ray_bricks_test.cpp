#include <gtest/gtest.h>

#include "tests/transitions/kernels/ray_cast_reference.hpp"

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

template <class T>
void bricks_change_no_byte(const Volume<T>& volume, Type type) {
    const Extent& n = volume.extent;
    // Opaque in a narrow band only: values at both ends of a brick's range are transparent.
    const std::vector<OpticsPoint> points = {
        {30, 0, {1, 1, 1}}, {31, 0.5, {1, 0, 1}}, {32, 0, {1, 1, 1}}};
    for (const ValueMap& values : {ValueMap{}, ValueMap{-1, 60}})
        for (const Hold hold : {Hold::zoh, Hold::foh, Hold::bspline3})
            for (const double step : {1.0, 0.21, 2.9, 7.3})
                for (const Rays& rays :
                     {turned(n, 0.6, 0.4, 64), turned(n, 0, 0, 64), from_eye(n, 64, 55)})
                    for (const Combine rule : {Combine::max, Combine::over}) {
                        const Optics optics = optics_of(points, 1, values);
                        RayCast cast{.volume = volume.grid(type, values),
                                     .hold = hold,
                                     .rule = rule,
                                     .rays = rays,
                                     .step = step,
                                     .optics = &optics};
                        const int channels = rule == Combine::over ? 4 : 1;
                        std::vector<float> plain(64 * 64 * channels), skipped(plain.size());
                        ray_cast(cast, 0, 0, 64, 64, plain.data(), 64 * channels);
                        Bricks bricks(n, std::pmr::get_default_resource());
                        const Optics* opaque = rule == Combine::over ? &optics : nullptr;
                        // In two calls, as threads would.
                        brick_layers(cast.volume, opaque, 5, bricks.extent.z, bricks);
                        brick_layers(cast.volume, opaque, 0, 5, bricks);
                        join_layers(bricks, 3, bricks.extent.y);
                        join_layers(bricks, 0, 3);
                        cast.bricks = &bricks;
                        ray_cast(cast, 0, 0, 64, 64, skipped.data(), 64 * channels);
                        ASSERT_EQ(0, std::memcmp(plain.data(), skipped.data(),
                                                 plain.size() * sizeof(float)))
                            << static_cast<int>(hold) << ' ' << step;
                    }
}

/// The largest of each brick and its neighbours, sample by sample.
template <class T>
void bricks_hold_largest(Type type, const Extent& n) {
    const auto volume = random_volume<T>(n, std::is_signed_v<T> ? -100 : 0, 100, 8);
    for (const double slope : {1.0, -1.0}) {
        Bricks bricks(n, std::pmr::get_default_resource());
        brick_layers(volume.grid(type, {slope, 0}), nullptr, 0, bricks.extent.z, bricks);
        join_layers(bricks, 0, bricks.extent.y);
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

}  // namespace
}  // namespace edgewise::kernels
