#include <gtest/gtest.h>

#include "tests/transitions/kernels/ray_cast_reference.hpp"
#include "transitions/kernels/ray_path.hpp"

namespace edgewise::kernels {
namespace {

/// Casts a square picture and compares every pixel with the reference.
void expect_like_reference(const RayCast& cast, const std::vector<OpticsPoint>& points, double unit,
                           int pixels, double tolerance) {
    const int channels = cast.rule == Combine::over ? 4 : 1;
    std::vector<float> picture(pixels * pixels * channels, -77.0f);
    ray_cast(cast, 0, 0, pixels, pixels, picture.data(), pixels * channels);
    double worst = 0;
    for (int y = 0; y < pixels; ++y)
        for (int x = 0; x < pixels; ++x) {
            const auto want = reference(cast, points, unit, x, y);
            for (int c = 0; c < channels; ++c)
                worst =
                    std::max(worst, std::abs(picture[(y * pixels + x) * channels + c] - want[c]));
        }
    EXPECT_LE(worst, tolerance) << "rule " << static_cast<int>(cast.rule) << " hold "
                                << static_cast<int>(cast.hold);
}

const std::vector<OpticsPoint> kColors = {{20, 0, {1, 0, 0}},
                                          {90, 0.3, {0.2, 0.8, 0}},
                                          {91, 0.05, {0.2, 0.8, 1}},
                                          {200, 0.6, {1, 1, 0.5}}};
const std::vector<OpticsPoint> kGrey = {{0, 0, {0, 0, 0}}, {255, 0.05, {1, 1, 1}}};

/// Positions in f32 are off by at most kDrift; a value by that times the largest slope, which for
/// samples in [0, 255] and any hold is below 3 axes x 255. Weights of 14 bits add 255 / 2^15.
constexpr double kDrift = 1e-5;
constexpr double kValueTolerance = 3 * 255 * kDrift + 255.0 / 32768 * 3;

template <class T>
void all_rules(const Volume<T>& volume, Type type, ValueMap values, Hold hold, const Rays& rays,
               int pixels, const Kept* kept = nullptr) {
    for (const double step : {1.0, 0.5, 0.37})
        for (const Combine rule : {Combine::max, Combine::sum, Combine::mean, Combine::over}) {
            const Optics optics = optics_of(kColors, 0.8, values);
            RayCast cast{.volume = volume.grid(type, values),
                         .hold = hold,
                         .rule = rule,
                         .rays = rays,
                         .kept = kept,
                         .step = step,
                         .unit = 0.7,
                         .zero = 3,
                         .miss = -5,
                         .optics = &optics};
            // A nearest sample changes at once where rounding moves a position across a border.
            // The steepest stretch of kColors turns an error of 1 into 0.25 of opacity.
            const double length = 60;
            const double tolerance = rule == Combine::sum    ? kValueTolerance * length
                                     : rule == Combine::over ? 0.25 * kValueTolerance * 4
                                                             : kValueTolerance;
            expect_like_reference(cast, kColors, 0.8, pixels, tolerance);
        }
}

TEST(RayCast, EveryFastTypeEqualsTheReference) {
    const Extent n{21, 17, 26};
    const Rays rays = turned(n, 0.4, -0.7, 29);
    for (const Hold hold : {Hold::foh, Hold::bspline3}) {
        all_rules(random_volume<std::uint8_t>(n, 0, 256, 1), Type::u8, {}, hold, rays, 29);
        all_rules(random_volume<std::int8_t>(n, -128, 128, 2), Type::i8, {1, 100}, hold, rays, 29);
        all_rules(random_volume<std::uint16_t>(n, 0, 65536, 3), Type::u16, {1 / 257.0, 0}, hold,
                  rays, 29);
        all_rules(random_volume<std::int16_t>(n, -32768, 32768, 4), Type::i16, {-1 / 257.0, 128},
                  hold, rays, 29);
        all_rules(random_volume<float>(n, 0, 255, 5), Type::f32, {}, hold, rays, 29);
        all_rules(random_volume<std::int32_t>(n, 0, 255, 6), Type::i32, {}, hold, rays, 29);
        all_rules(random_volume<double>(n, 0, 255, 7), Type::f64, {2, -3}, hold, rays, 29);
    }
}

TEST(RayCast, NearestSamplesEqualTheReference) {
    // A position that rounding moves across a border would show as a whole sample, so the planes of
    // this volume change along z only, and rays meet them away from the borders.
    const Extent n{12, 10, 14};
    Volume<std::uint8_t> volume(n);
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x)
                volume.at(x, y, z) = static_cast<std::uint8_t>(17 * x + 5 * y + 11 * z);
    Rays rays;
    rays.origin = {.base = {0.123, -0.211, -3.217}, .x = {1, 0, 0}, .y = {0, 1, 0}};
    rays.direction.base = {0, 0, 1};
    all_rules(volume, Type::u8, {}, Hold::zoh, rays, 14);
}

TEST(RayCast, PerspectiveEqualsTheReference) {
    const Extent n{21, 17, 26};
    for (const double distance : {45.0, 3.0}) {  // before the volume, and inside it
        const Rays rays = from_eye(n, 29, distance);
        all_rules(random_volume<std::uint8_t>(n, 0, 256, 8), Type::u8, {}, Hold::foh, rays, 29);
        all_rules(random_volume<float>(n, 0, 255, 9), Type::f32, {}, Hold::bspline3, rays, 29);
    }
}

/// A part of a volume: a box, what two oblique planes leave of it, and what balls leave, of which
/// the second is an ellipsoid that leans.
std::vector<Kept> parts_of(const Extent& n) {
    const double x = static_cast<double>(n.x), y = static_cast<double>(n.y),
                 z = static_cast<double>(n.z);
    Kept box{{3.25, -0.5, 5}, {x - 4.5, y - 2.75, z - 0.5}, {}};
    Kept cut = box;
    cut.planes = {{{0.6, 0, 0.8}, -12.3}, {{0.36, -0.8, -0.48}, 9.1}};
    Kept corner{{-0.5, -0.5, -0.5}, {x - 0.5, y - 0.5, z - 0.5}, {}};
    corner.planes = {{{-0.48, -0.6, -0.64}, 7.77}};
    Kept ball{{-0.5, -0.5, -0.5}, {x - 0.5, y - 0.5, z - 0.5}, {}};
    ball.balls = {{{0.4 * x, 0.5 * y, 0.6 * z}, {0.12, 0, 0, 0, 0.12, 0, 0, 0, 0.12}}};
    Kept lens = cut;
    lens.balls = ball.balls;
    lens.balls.push_back({{0.6 * x, 0.6 * y, 0.5 * z}, {0.1, 0.02, 0, 0, 0.15, -0.03, 0, 0, 0.08}});
    return {box, cut, corner, ball, lens};
}

TEST(RayCast, PartsOfAVolumeEqualTheReference) {
    const Extent n{21, 17, 26};
    const auto bytes = random_volume<std::uint8_t>(n, 0, 256, 40);
    const auto floats = random_volume<float>(n, 0, 255, 41);
    for (const Kept& kept : parts_of(n))
        for (const Rays& rays : {turned(n, 0.4, -0.7, 29), turned(n, 0, 0, 29), from_eye(n, 29, 45),
                                 from_eye(n, 29, 3)}) {
            all_rules(bytes, Type::u8, {}, Hold::foh, rays, 29, &kept);
            all_rules(floats, Type::f32, {}, Hold::bspline3, rays, 29, &kept);
        }
}

TEST(RayCast, PartsWithBricksAndInTilesAreTheSameBytes) {
    const Extent n{40, 33, 30};
    const auto volume = random_volume<std::uint8_t>(n, 0, 256, 42);
    const Optics optics = optics_of(kGrey, 1, {});
    constexpr int kSide = 53;
    for (const Kept& kept : parts_of(n))
        for (const Rays& rays : {turned(n, 0.6, 0.4, kSide), from_eye(n, kSide, 70)})
            for (const Combine rule : {Combine::max, Combine::over}) {
                RayCast cast{.volume = volume.grid(Type::u8),
                             .rule = rule,
                             .rays = rays,
                             .kept = &kept,
                             .step = 0.5,
                             .optics = &optics};
                const int channels = rule == Combine::over ? 4 : 1;
                std::vector<float> whole(kSide * kSide * channels), tiles(whole.size());
                ray_cast(cast, 0, 0, kSide, kSide, whole.data(), kSide * channels);
                Bricks bricks(n, std::pmr::get_default_resource());
                const LevelsOf of{.optics = rule == Combine::over ? &optics : nullptr};
                if (of.ranges()) bricks.least.resize(bricks.level.size());
                brick_layers(cast.volume, of, 0, bricks.extent.z, bricks);
                join_layers(cast.volume, of, 0, bricks.extent.y, bricks);
                cast.bricks = &bricks;
                for (int y = 0; y < kSide; y += 7)
                    for (int x = 0; x < kSide; x += 5)
                        ray_cast(cast, x, y, std::min(5, kSide - x), std::min(7, kSide - y),
                                 tiles.data() + (y * kSide + x) * channels, kSide * channels);
                EXPECT_EQ(0, std::memcmp(whole.data(), tiles.data(), whole.size() * sizeof(float)));
            }
}

TEST(RayCast, ThinVolumesEqualTheReference) {
    for (const Extent& n : {Extent{1, 1, 1}, Extent{9, 7, 1}, Extent{1, 8, 8}, Extent{8, 1, 5},
                            Extent{2, 2, 2}, Extent{1, 1, 9}})
        for (const double turn : {0.0, 0.5, 1.5707963267948966}) {
            const Rays rays = turned(n, turn, 0.2 * turn, 13);
            for (const Hold hold : {Hold::foh, Hold::bspline3}) {
                all_rules(random_volume<std::uint8_t>(n, 0, 256, 10), Type::u8, {}, hold, rays, 13);
                all_rules(random_volume<float>(n, 0, 255, 11), Type::f32, {}, hold, rays, 13);
            }
        }
}

TEST(RayCast, AnyDirectionWithZeroComponentsHitsEachFaceOnce) {
    const Extent n{5, 6, 7};
    auto volume = random_volume<float>(n, 0, 255, 12);
    for (const double zero : {0.0, -0.0})
        for (int axis = 0; axis < 3; ++axis)
            for (const double sign : {1.0, -1.0})
                for (const double corner : {-0.5, 0.0, -0.25}) {
                    Rays rays;
                    rays.direction.base = {zero, zero, zero};
                    rays.direction.base[axis] = sign;
                    rays.origin.base = {corner, corner, corner};
                    rays.origin.x[(axis + 1) % 3] = 1;
                    rays.origin.y[(axis + 2) % 3] = 1;
                    RayCast cast{.volume = volume.grid(Type::f32),
                                 .hold = Hold::foh,
                                 .rule = Combine::sum,
                                 .rays = rays};
                    expect_like_reference(cast, {}, 1, 9, 255 * 7 * 1e-6);
                    cast.rule = Combine::max;
                    cast.miss = -3;
                    expect_like_reference(cast, {}, 1, 9, 255 * 1e-6);
                }
}

TEST(RayCast, VoxelsOnTheLatticeAreCopied) {
    // Cells from the volume's front face on: samples at 0, 1, 2 ... are the voxels themselves.
    const Extent n{16, 9, 1};
    auto volume = random_volume<float>(n, -1e6, 1e6, 13);
    Rays rays;
    rays.origin = {.base = {0, 0, -0.5}, .x = {1, 0, 0}, .y = {0, 1, 0}};
    rays.direction.base = {0, 0, 1};
    for (const Hold hold : {Hold::zoh, Hold::foh}) {
        const RayCast cast{.volume = volume.grid(Type::f32), .hold = hold, .rays = rays};
        std::vector<float> picture(16 * 9);
        ray_cast(cast, 0, 0, 16, 9, picture.data(), 16);
        EXPECT_EQ(0, std::memcmp(picture.data(), volume.samples.data(), 16 * 9 * sizeof(float)));
    }
}

TEST(RayCast, ConstantVolumeIntegratesToItsChord) {
    const Extent n{40, 300, 40};
    Volume<float> volume(n);
    std::fill(volume.samples.begin(), volume.samples.end(), 0.1f);
    for (const double step : {1.0, 0.25, 3.7}) {
        RayCast cast{.volume = volume.grid(Type::f32),
                     .hold = Hold::foh,
                     .rule = Combine::sum,
                     .rays = turned(n, 1.5, 0.3, 32),
                     .step = step,
                     .unit = 2};
        std::vector<float> picture(32 * 32);
        ray_cast(cast, 0, 0, 32, 32, picture.data(), 32);
        for (int y = 0; y < 32; ++y)
            for (int x = 0; x < 32; ++x) {
                const Interval in =
                    chord(cast, cast.rays.origin.at(x, y), cast.rays.direction.at(x, y));
                const double want = std::max(0.0, in.high - in.low) * 0.1f * 2;
                // Sums of 32 cells, then of blocks: some 40 roundings of 6e-8.
                EXPECT_NEAR(picture[y * 32 + x], want, 2.4e-6 * want + 1e-9);
            }
        cast.rule = Combine::mean;
        ray_cast(cast, 0, 0, 32, 32, picture.data(), 32);
        EXPECT_NEAR(picture[16 * 32 + 16], 0.1f, 2.4e-7);
    }
}

TEST(RayCast, HomogeneousSlabKeepsItsTransparencyAtAnyStep) {
    const double opacity = 0.4, thickness = 4;
    Volume<std::uint8_t> volume({3, 3, 4});
    std::fill(volume.samples.begin(), volume.samples.end(), std::uint8_t{9});
    const std::vector<OpticsPoint> points = {{0, opacity, {1, 0.5, 0.25}}};
    const Optics optics = optics_of(points, 1, {});
    Rays rays;
    rays.origin = {.base = {0, 0, -7.77}, .x = {1, 0, 0}, .y = {0, 1, 0}};
    rays.direction.base = {0, 0, 1};
    for (const double step : {1.0, 0.5, 0.25, 0.125, 0.3, 2.5, 4.0}) {
        const RayCast cast{.volume = volume.grid(Type::u8),
                           .rule = Combine::over,
                           .rays = rays,
                           .step = step,
                           .optics = &optics};
        float pixel[4];
        ray_cast(cast, 1, 1, 1, 1, pixel, 4);
        // Transparencies of pieces multiply to 0.6^4 (EQ 63), and the light of a medium that emits
        // 1 is what is not let through (S22).
        const double light = 1 - std::pow(1 - opacity, thickness);
        EXPECT_NEAR(pixel[3], light, 1e-6) << step;
        EXPECT_NEAR(pixel[0], light, 1e-6) << step;
        EXPECT_NEAR(pixel[2], 0.25 * light, 1e-6) << step;
    }
}

TEST(RayCast, OpaqueAndNearlyTransparentMediaKeepTheirLimits) {
    Volume<std::uint8_t> volume({2, 2, 64});
    Rays rays;
    rays.origin = {.base = {0, 0, -2}, .x = {1, 0, 0}, .y = {0, 1, 0}};
    rays.direction.base = {0, 0, 1};
    for (const double opacity : {1.0, 1e-7, 1e-4}) {
        const std::vector<OpticsPoint> points = {{0, opacity, {1, 1, 1}}};
        const Optics optics = optics_of(points, 1, {});
        const RayCast cast{.volume = volume.grid(Type::u8),
                           .rule = Combine::over,
                           .rays = rays,
                           .step = 0.125,
                           .optics = &optics};
        float pixel[4];
        ray_cast(cast, 0, 0, 1, 1, pixel, 4);
        const double want = -std::expm1(64 * std::log1p(-opacity));
        // Light is a sum of 512 parts that keep 24 bits each; transparency loses up to 2^-25 a
        // part.
        EXPECT_NEAR(pixel[0], want, 512 * want * 6e-8);
        EXPECT_NEAR(pixel[3], want, 512 * 3e-8);
    }
}

/// The same rays farther from each other.
Rays apart(Rays rays, double distance, double pixels) {
    const double moved = -0.5 * (pixels - 1) * (distance - 1);
    rays.origin.base = rays.origin.base + moved * (rays.origin.x + rays.origin.y);
    rays.origin.x = distance * rays.origin.x;
    rays.origin.y = distance * rays.origin.y;
    return rays;
}

/// Lines are asked for ahead, also beyond the volume's ends, where rays have neighbours far away. A
/// ray by itself has none, and the same bytes.
template <class T>
void alone_as_among_others(const Volume<T>& volume, Type type, const Rays& rays, int pixels) {
    for (const Hold hold : {Hold::zoh, Hold::foh})
        for (const Combine rule : {Combine::max, Combine::sum}) {
            RayCast cast{.volume = volume.grid(type), .hold = hold, .rule = rule, .rays = rays};
            std::vector<float> picture(pixels * pixels);
            ray_cast(cast, 0, 0, pixels, pixels, picture.data(), pixels);
            ASSERT_LT(*std::min_element(picture.begin(), picture.end()),
                      *std::max_element(picture.begin(), picture.end()));
            for (int y = 0; y < pixels; ++y)
                for (int x = 0; x < pixels; ++x) {
                    cast.rays.origin = {.base = rays.origin.at(x, y)};
                    ASSERT_FALSE(is_sparse(cast));
                    float alone = -1;
                    ray_cast(cast, 0, 0, 1, 1, &alone, 1);
                    ASSERT_EQ(alone, picture[y * pixels + x]) << x << ' ' << y;
                }
        }
}

TEST(RayCast, SparseSamplesOfLargeVolumes) {
    const Extent n{200, 190, 171};
    const Rays dense = turned(n, 0.4, -0.3, 13), far = apart(dense, 14, 13);
    const auto is_sparse_of = [&](Type type, const Rays& rays) {
        const Grid volume{nullptr, type, n, 1, {}};
        return is_sparse({.volume = volume, .rays = rays});
    };
    EXPECT_TRUE(is_sparse_of(Type::f32, far));
    EXPECT_TRUE(is_sparse_of(Type::f32, apart(dense, 0.72, 13)));  // 0.52 voxels: a line for 31
    EXPECT_FALSE(is_sparse_of(Type::f32, apart(dense, 0.69, 13)));
    EXPECT_TRUE(is_sparse_of(Type::i16, dense)) << "a line for just 32, whatever is rounded";
    EXPECT_FALSE(is_sparse_of(Type::i16, apart(dense, 0.99, 13)));
    EXPECT_FALSE(is_sparse_of(Type::u8, far));  // caches hold it
    EXPECT_FALSE(is_sparse_of(Type::f32, from_eye(n, 13, 400)));
    ASSERT_TRUE(is_sparse_of(Type::i16, far));
    alone_as_among_others(random_volume<float>(n, 1, 255, 5), Type::f32, far, 13);
    alone_as_among_others(random_volume<std::int16_t>(n, 1, 255, 6), Type::i16, far, 13);
}

TEST(RayCast, NotFiniteSamplesCountAsOutside) {
    const Extent n{13, 13, 13};
    auto volume = random_volume<float>(n, 1, 255, 14);
    const float bad[] = {std::numeric_limits<float>::quiet_NaN(),
                         std::numeric_limits<float>::infinity(),
                         -std::numeric_limits<float>::infinity()};
    for (int i = 0; i < 3; ++i) volume.at(5 + i, 6, 5 + i) = bad[i];
    for (const Hold hold : {Hold::foh, Hold::bspline3})
        all_rules(volume, Type::f32, {}, hold, turned(n, 0.35, 0.1, 15), 15);

    std::fill(volume.samples.begin(), volume.samples.end(), bad[0]);
    RayCast cast{.volume = volume.grid(Type::f32), .rays = turned(n, 0.35, 0.1, 15), .miss = 42};
    float pixel = 0;
    ray_cast(cast, 7, 7, 1, 1, &pixel, 1);
    EXPECT_EQ(pixel, 42);
    cast.rule = Combine::sum;
    ray_cast(cast, 7, 7, 1, 1, &pixel, 1);
    EXPECT_EQ(pixel, 0);
}

/// Rays through samples lose the one that is not finite, and nothing beside it.
TEST(RayCast, LosesNoSampleBesideOneThatIsNotFinite) {
    const Extent n{9, 9, 9};
    auto volume = random_volume<double>(n, 1, 2, 14);
    std::fill(volume.samples.begin(), volume.samples.end(), 1.0);
    volume.at(4, 4, 4) = std::numeric_limits<double>::quiet_NaN();
    volume.at(8, 8, 8) = std::numeric_limits<double>::infinity();
    volume.at(0, 3, 0) = -std::numeric_limits<double>::infinity();
    auto floats = random_volume<float>(n, 1, 2, 14);
    std::copy(volume.samples.begin(), volume.samples.end(), floats.samples.begin());
    for (const Type type : {Type::f32, Type::f64})
        for (const Hold hold : {Hold::zoh, Hold::foh})
            for (int axis = 0; axis < 3; ++axis) {
                RayCast cast{.volume = type == Type::f32 ? floats.grid(type) : volume.grid(type),
                             .hold = hold,
                             .rule = Combine::sum};
                const int across = (axis + 1) % 3, down = (axis + 2) % 3;
                cast.rays.origin.x[across] = cast.rays.origin.y[down] = 1;
                cast.rays.origin.base[axis] = -0.5;  // cells are sampled at their middles
                cast.rays.direction.base[axis] = 1;
                std::vector<float> picture(81);
                ray_cast(cast, 0, 0, 9, 9, picture.data(), 9);
                for (int y = 0; y < 9; ++y)
                    for (int x = 0; x < 9; ++x) {
                        std::array<int, 3> p{};
                        p[across] = x, p[down] = y;
                        int missing = 0;
                        for (p[axis] = 0; p[axis] < 9; ++p[axis])
                            missing += !std::isfinite(volume.at(p[0], p[1], p[2]));
                        EXPECT_NEAR(picture[9 * y + x], 9 - missing, 1e-5)
                            << axis << ": " << x << ", " << y;
                    }
            }
}

TEST(RayCast, TilesShowNowhere) {
    const Extent n{40, 50, 30};
    const auto volume = random_volume<std::uint16_t>(n, 0, 65535, 15);
    const std::vector<OpticsPoint> points = {{0, 0, {0, 0, 0}}, {65535, 0.9, {1, 1, 1}}};
    const Optics optics = optics_of(points, 1, {});
    for (const Rays& rays : {turned(n, 0.6, 0.4, 61), from_eye(n, 61, 70)})
        for (const Combine rule : {Combine::max, Combine::sum, Combine::over}) {
            const RayCast cast{.volume = volume.grid(Type::u16),
                               .rule = rule,
                               .rays = rays,
                               .step = 0.5,
                               .optics = &optics,
                               .bound = 1.0 / 1024};
            const int channels = rule == Combine::over ? 4 : 1;
            std::vector<float> whole(61 * 61 * channels), tiles(whole.size());
            ray_cast(cast, 0, 0, 61, 61, whole.data(), 61 * channels);
            for (int y = 0; y < 61; y += 7)
                for (int x = 0; x < 61; x += 5)
                    ray_cast(cast, x, y, std::min(5, 61 - x), std::min(7, 61 - y),
                             tiles.data() + (y * 61 + x) * channels, 61 * channels);
            EXPECT_EQ(0, std::memcmp(whole.data(), tiles.data(), whole.size() * sizeof(float)));
        }
}

TEST(RayCast, EarlyTerminationStaysWithinItsBound) {
    const Extent n{30, 30, 60};
    const auto volume = random_volume<std::uint8_t>(n, 0, 256, 16);
    const Optics optics = optics_of(kColors, 1, {});
    RayCast cast{.volume = volume.grid(Type::u8),
                 .rule = Combine::over,
                 .rays = turned(n, 0.2, 0.3, 40),
                 .step = 0.5,
                 .optics = &optics};
    std::vector<float> full(40 * 40 * 4), ended(full.size());
    ray_cast(cast, 0, 0, 40, 40, full.data(), 160);
    for (const double bound : {0.05, 1e-3, 1e-6}) {
        cast.bound = bound;
        ray_cast(cast, 0, 0, 40, 40, ended.data(), 160);
        for (std::size_t i = 0; i < full.size(); ++i)
            ASSERT_LE(std::abs(full[i] - ended[i]), bound + 1e-6);
    }
}

TEST(RayCast, CountsWhatCompositesCorrect) {
    // Packets are at most four pixels wide and high: none has rays in both halves.
    const Extent n{32, 16, 20};
    Volume<std::uint8_t> volume(n);
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < 16; ++x) volume.at(x, y, z) = 255;
    Rays rays;
    rays.origin = {.base = {0, 0, -0.5}, .x = {1, 0, 0}, .y = {0, 1, 0}};
    rays.direction.base = {0, 0, 1};
    Taken taken;
    RayCast cast{.volume = volume.grid(Type::u8),
                 .hold = Hold::zoh,
                 .rule = Combine::over,
                 .rays = rays,
                 .bound = 1e-3,
                 .taken = &taken};
    std::vector<float> picture(32 * 16 * 4);
    const auto count = [&](const Optics& optics) {
        cast.optics = &optics;
        taken = {};
        ray_cast(cast, 0, 0, 32, 16, picture.data(), 32 * 4);
    };
    // Opacities of whole cells are those of a step.
    count(optics_of(kGrey, 1, {}));
    EXPECT_EQ(taken.samples, 32 * 16 * 18);
    EXPECT_EQ(taken.ends, 32 * 16 * 2);
    EXPECT_EQ(taken.corrected_ends, 16 * 16 * 2);
    EXPECT_EQ(taken.corrected, 0);
    count(optics_of(kGrey, 2, {}));
    EXPECT_EQ(taken.corrected_ends, 16 * 16 * 2);
    EXPECT_EQ(taken.corrected, 16 * 16 * 18);
    // Hidden behind their first samples: these rays are looked at every few cells.
    count(optics_of(std::vector<OpticsPoint>{{0, 0, {0, 0, 0}}, {255, 1, {1, 1, 1}}}, 2, {}));
    EXPECT_EQ(taken.corrected_ends, 16 * 16);
    EXPECT_EQ(taken.corrected, 0);
}

}  // namespace
}  // namespace edgewise::kernels
