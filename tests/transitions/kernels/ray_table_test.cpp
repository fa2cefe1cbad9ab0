#include "transitions/kernels/ray_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "tests/transitions/kernels/ray_cast_reference.hpp"
#include "transitions/kernels/ray_cast.hpp"

namespace edgewise::kernels {
namespace {

constexpr int kPixels = 29;

/// Opacities that change by at most 0.012 a value and 0.02 a gradient.
TransferTable gentle_table() {
    TransferTable table;
    table.values = {20, 61.5, 100, 180, 240};
    table.gradients = {4, 25, 60};
    std::mt19937 random(1);
    std::uniform_real_distribution<double> part(0, 0.4), color(0, 1);
    for (int i = 0; i < 15; ++i) {
        table.opacity.push_back(part(random));
        table.color.push_back({color(random), color(random), color(random)});
    }
    return table;
}

/// One ray, in f64 and one sample after the other. @param per_length  samples in a file unit
std::array<double, 4> expected(const RayCast& cast, const TransferTable& table,
                               const Vector& per_length, double px, double py) {
    const Vector origin = cast.rays.origin.at(px, py), direction = cast.rays.direction.at(px, py);
    const Interval in = chord(cast, origin, direction);
    const auto value = [&](const Vector& p) {
        return cast.volume.values(sampled(cast.volume, cast.hold, p));
    };
    double left = 1;
    std::array<double, 4> light{};
    for (double k = std::floor(in.low / cast.step); k * cast.step < in.high; ++k) {
        const double from = std::max(in.low, k * cast.step);
        const double to = std::min(in.high, (k + 1) * cast.step);
        if (!(from < to)) continue;
        Vector p = origin + 0.5 * (from + to) * direction;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = std::clamp(p[axis], 0.0, double(cast.volume.extent[axis] - 1));
        double square = 0;
        for (int axis = 0; axis < 3; ++axis) {
            Vector aside{};
            aside[axis] = 1;
            const double slope = 0.5 * (value(p + aside) - value(p + -1 * aside));
            square += std::pow(slope * per_length[axis], 2);
        }
        const auto at = table.at(value(p), std::sqrt(square));
        const double opacity = 1 - std::pow(1 - at[3], (to - from) / cast.optics->unit);
        for (int c = 0; c < 3; ++c) light[c] += left * opacity * at[c];
        left *= 1 - opacity;
    }
    light[3] = 1 - left;
    return light;
}

/// What tables ask of optics: their unit.
Optics unit_of(double unit) {
    const std::vector<OpticsPoint> one{{0, 1, {1, 1, 1}}};
    return optics_of(one, unit, {});
}

template <class T>
void expect_like_table(const Volume<T>& volume, Type type, const ValueMap& values,
                       const TransferTable& table, const Rays& rays, const Kept* kept = nullptr) {
    const Vector per_length{1, 0.5, 1.25};
    const RayTable tabled = ray_table_of(table, {1, 0.5, 1.25}, values);
    const Optics optics = unit_of(0.8);
    for (const double step : {1.0, 0.8, 0.37}) {
        RayCast cast{.volume = volume.grid(type, values),
                     .rule = Combine::over,
                     .rays = rays,
                     .kept = kept,
                     .step = step,
                     .optics = &optics,
                     .table = &tabled};
        std::vector<float> picture(kPixels * kPixels * 4, -77.0f);
        ray_cast(cast, 0, 0, kPixels, kPixels, picture.data(), kPixels * 4);
        double worst = 0;
        for (int y = 0; y < kPixels; ++y)
            for (int x = 0; x < kPixels; ++x) {
                const auto want = expected(cast, table, per_length, x, y);
                for (std::size_t c = 0; c < 4; ++c)
                    worst = std::max(worst, std::abs(picture[(y * kPixels + x) * 4 + c] - want[c]));
            }
        // Places in f32 are off by 1e-5, values and each part of gradients by 3 x 255 times that
        // and by weights of 14 bits: 0.031. Opacities by 0.012 x 0.031 + 0.02 x 1.25 sqrt(3) x
        // 0.031, four times as much over a ray that ends in a few units.
        EXPECT_LE(worst, 7e-3) << name_of(type) << " step " << step;
    }
}

TEST(RayTable, CastsEqualTheReference) {
    const Extent n{21, 17, 26};
    const TransferTable table = gentle_table();
    for (const Rays& rays : {turned(n, 0.4, -0.7, kPixels), turned(n, 0, 0, kPixels)}) {
        expect_like_table(random_volume<std::uint8_t>(n, 0, 256, 1), Type::u8, {}, table, rays);
        expect_like_table(random_volume<std::int16_t>(n, -32768, 32768, 4), Type::i16,
                          {-1 / 257.0, 128}, table, rays);
        expect_like_table(random_volume<float>(n, 0, 255, 5), Type::f32, {}, table, rays);
        expect_like_table(random_volume<double>(n, 0, 120, 7), Type::f64, {2, -3}, table, rays);
    }
    Kept kept{{2, -0.5, -0.5}, {20.5, 16.5, 20}, {}};
    kept.balls = {{{10, 8, 12}, {0.12, 0, 0, 0, 0.12, 0, 0, 0, 0.12}}};
    expect_like_table(random_volume<float>(n, 0, 255, 5), Type::f32, {}, table,
                      turned(n, 0.4, -0.7, kPixels), &kept);
}

TEST(RayTable, OfOneCellIsAConstant) {
    const Extent n{5, 4, 6};
    TransferTable table{.values = {7}, .gradients = {0}, .opacity = {0.3}, .color = {{1, 0.5, 0}}};
    expect_like_table(random_volume<float>(n, 0, 255, 5), Type::f32, {}, table,
                      turned(n, 0.4, -0.7, kPixels));
    table.values = {7, 9}, table.opacity = {0.3, 0.3}, table.color.resize(2, {1, 0.5, 0});
    expect_like_table(random_volume<std::uint8_t>({1, 1, 1}, 0, 255, 5), Type::u8, {}, table,
                      turned({1, 1, 1}, 0.4, -0.7, kPixels));
}

/// Holes between what is seen, both by value and by gradient, and a jump.
TransferTable holes() {
    TransferTable table;
    table.values = {0, 40, 60, 61, 100, 140, 200, 255};
    table.gradients = {0, 10, 40};
    const std::vector<double> seen{0, 0, 0, 0.6, 0.2, 0, 0, 0.9};
    for (int row = 0; row < 3; ++row)
        for (std::size_t i = 0; i < 8; ++i) {
            table.opacity.push_back(seen[i] * row / 2);
            table.color.push_back({seen[i], 1 - seen[i], 0.5});
        }
    return table;
}

template <class T>
void expect_same_bytes(const Volume<T>& volume, Type type, const ValueMap& values, Hold hold) {
    const Extent& n = volume.extent;
    constexpr int kSide = 53;
    const RayTable table = ray_table_of(holes(), {1, 1, 1}, values);
    const Optics optics = unit_of(1);
    for (const Rays& rays : {turned(n, 0.6, 0.4, kSide), from_eye(n, kSide, 70)}) {
        RayCast cast{.volume = volume.grid(type, values),
                     .hold = hold,
                     .rule = Combine::over,
                     .rays = rays,
                     .step = 0.5,
                     .optics = &optics,
                     .table = &table,
                     .bound = 1.0 / 4096};
        std::vector<float> whole(kSide * kSide * 4), tiles(whole.size());
        ray_cast(cast, 0, 0, kSide, kSide, whole.data(), kSide * 4);
        Taken all, left;
        cast.taken = &all;
        ray_cast(cast, 0, 0, kSide, kSide, tiles.data(), kSide * 4);
        Bricks bricks(n, std::pmr::get_default_resource());
        const LevelsOf of{.optics = &optics, .table = &table};
        bricks.least.resize(bricks.level.size());
        brick_layers(cast.volume, of, 0, bricks.extent.z, bricks);
        join_layers(cast.volume, of, 0, bricks.extent.y, bricks);
        cast.bricks = &bricks;
        cast.taken = &left;
        // Tiles of whole packets, as edges have them: gradients of a packet are worked out
        // together.
        constexpr int kTile = 16;
        for (int y = 0; y < kSide; y += kTile)
            for (int x = 0; x < kSide; x += kTile)
                ray_cast(cast, x, y, std::min(kTile, kSide - x), std::min(kTile, kSide - y),
                         tiles.data() + (y * kSide + x) * 4, kSide * 4);
        EXPECT_EQ(0, std::memcmp(whole.data(), tiles.data(), whole.size() * sizeof(float)))
            << name_of(type) << " hold " << static_cast<int>(hold);
        EXPECT_LT(left.samples, all.samples);
        EXPECT_TRUE(std::all_of(whole.begin(), whole.end(),
                                [](float part) { return part >= 0 && part <= 1; }));
        EXPECT_TRUE(
            std::any_of(whole.begin(), whole.end(), [](float part) { return part > 0.1f; }));
    }
}

TEST(RayTable, BricksAndTilesAreTheSameBytes) {
    const Extent n{40, 33, 30};
    // Large empty parts, and noise on what is not.
    const auto fill = [&](auto volume, auto&& value) {
        std::mt19937 random(9);
        std::uniform_real_distribution<double> noise(-20, 20);
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x) {
                    const double far = std::hypot(x - 20, y - 16, z - 15);
                    volume.at(x, y, z) = value(far > 12 ? 30 : 160 - 8 * far + noise(random));
                }
        return volume;
    };
    const auto bytes = fill(Volume<std::uint8_t>(n), [](double v) {
        return static_cast<std::uint8_t>(std::clamp(v, 0.0, 255.0));
    });
    expect_same_bytes(bytes, Type::u8, {}, Hold::foh);
    const auto shorts = fill(Volume<std::int16_t>(n),
                             [](double v) { return static_cast<std::int16_t>(10 * (50 - v)); });
    expect_same_bytes(shorts, Type::i16, {-0.1, 50}, Hold::foh);
    auto floats = fill(Volume<float>(n), [](double v) { return static_cast<float>(v); });
    expect_same_bytes(floats, Type::f32, {}, Hold::foh);
    expect_same_bytes(floats, Type::f32, {}, Hold::bspline3);
    // Samples that are no numbers count as outside, and for gradients as the sample beside them.
    std::mt19937 random(10);
    const float bad[] = {std::numeric_limits<float>::quiet_NaN(),
                         std::numeric_limits<float>::infinity(),
                         -std::numeric_limits<float>::infinity()};
    for (int i = 0; i < 3000; ++i)
        floats.samples[random() % static_cast<unsigned>(n.samples())] = bad[i % 3];
    expect_same_bytes(floats, Type::f32, {}, Hold::foh);
    expect_same_bytes(floats, Type::f32, {}, Hold::zoh);
}

TEST(RayTable, TheLargestOfASpanIsThatOfItsValues) {
    for (const ValueMap values : {ValueMap{}, ValueMap{-0.5, 20}}) {
        const TransferTable table = holes();
        const RayTable tabled = ray_table_of(table, {1, 1, 1}, values);
        std::mt19937 random(11);
        std::uniform_real_distribution<float> end(-60, 300);
        for (int i = 0; i < 3000; ++i) {
            float low = static_cast<float>((double(end(random)) - values.offset) / values.slope),
                  high = i % 4 == 0 ? low
                                    : static_cast<float>((double(end(random)) - values.offset) /
                                                         values.slope);
            if (low > high) std::swap(low, high);
            double most = 0;
            for (int k = 0; k <= 400; ++k)
                most = std::max(most, table.at(values(low + (high - low) * k / 400.0), 99)[3]);
            const float largest = tabled.largest(low, high);
            EXPECT_GE(largest, most - 1e-5) << low << ' ' << high;
            if (low == high) {
                EXPECT_NEAR(largest, most, 1e-4);
            }
        }
        const auto stored = [&](double value) {
            return static_cast<float>((value - values.offset) / values.slope);
        };
        EXPECT_EQ(tabled.largest(stored(0), stored(0)), 0);
        EXPECT_EQ(tabled.largest(stored(60), stored(60)), 0);
        EXPECT_EQ(
            tabled.largest(std::min(stored(145), stored(190)), std::max(stored(145), stored(190))),
            0);
        EXPECT_EQ(tabled.largest(1, 0), 0);  // nothing finite
        EXPECT_LE(tabled.bytes(), bytes_of_ray_table(table) * 2);
    }
}

}  // namespace
}  // namespace edgewise::kernels
