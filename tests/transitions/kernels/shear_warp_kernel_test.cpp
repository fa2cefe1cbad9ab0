#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <vector>

#include "transitions/kernels/shear_warp.hpp"

namespace edgewise::kernels {
namespace {

const std::vector<OpticsPoint> kPoints = {{20, 0, {1, 0, 0}}, {200, 0.3, {0.2, 0.8, 0.5}}};

template <class T>
std::vector<T> random_samples(const Extent& n, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> value(0, 120);
    std::vector<T> samples(n.samples() + kSlack);
    for (std::int64_t i = 0; i < n.samples(); ++i) samples[i] = static_cast<T>(value(random));
    return samples;
}

struct Tile {
    std::int64_t i, j, width, height;
};

std::vector<float> picture_of(const ShearWarp& warp, const Tile& tile) {
    const std::ptrdiff_t pitch = PixelStates::pitch_of(tile.width);
    const std::ptrdiff_t plane = pitch * tile.height;
    std::vector<float> low(plane + 16), high(plane + 16);
    std::vector<float> floats(plane * PixelStates::planes(warp.with.rule) + 16);
    const PixelStates states{floats.data(), pitch, plane};
    shear_spans(warp, tile.i, tile.j, tile.width, tile.height, low.data(), high.data(), pitch);
    clear_states(warp.with, states, tile.width, tile.height);
    shear_warp(warp, tile.i, tile.j, tile.width, tile.height, {low.data(), high.data(), pitch},
               states);
    const int channels = warp.with.rule == Combine::over ? 4 : 1;
    std::vector<float> out(tile.width * tile.height * channels);
    finish_states(warp.with, states, tile.width, tile.height, out.data(), tile.width * channels);
    return out;
}

double sampled(const Grid& g, Hold hold, double x, double y, std::int64_t k) {
    const auto at = [&](double i, double j) -> double {
        const auto ix = std::min<std::int64_t>(static_cast<std::int64_t>(i), g.extent.x - 1);
        const auto iy = std::min<std::int64_t>(static_cast<std::int64_t>(j), g.extent.y - 1);
        const std::int64_t n = (k * g.extent.y + iy) * g.extent.x + ix;
        switch (g.type) {
            case Type::u8:
                return g.as<std::uint8_t>()[n];
            case Type::i8:
                return g.as<std::int8_t>()[n];
            case Type::u16:
                return g.as<std::uint16_t>()[n];
            case Type::i16:
                return g.as<std::int16_t>()[n];
            case Type::f64:
                return g.as<double>()[n];
            default:
                return g.as<float>()[n];
        }
    };
    x = std::clamp(x, 0.0, g.extent.x - 1.0);
    y = std::clamp(y, 0.0, g.extent.y - 1.0);
    if (hold == Hold::zoh) return at(std::floor(x + 0.5), std::floor(y + 0.5));
    const double i = std::floor(x), j = std::floor(y), f = x - i, g2 = y - j;
    // A tap of weight 0 is not read: it may be infinite.
    const auto row = [&](double line) {
        return f > 0 ? (1 - f) * at(i, line) + f * at(i + 1, line) : at(i, line);
    };
    return g2 > 0 ? (1 - g2) * row(j) + g2 * row(j + 1) : row(j);
}

/// One pixel in f64. Which slices a ray meets is decided in f32, as the spans are written.
std::array<double, 4> reference(const ShearWarp& w, std::int64_t i, std::int64_t j) {
    float low_f, high_f;
    shear_spans(w, i, j, 1, 1, &low_f, &high_f, 16);
    double low = low_f, high = high_f;
    if (low < high && std::ceil(low) > high) {
        // Between two slices: as long a span that ends in the nearest one.
        const double length = high - low, before = std::floor(low), after = before + 1;
        const double down = low - before, up = after - high;
        const bool first = after >= static_cast<double>(w.volume.extent.z) ||
                           (before >= 0 && (w.backwards ? down < up : down <= up));
        low = first ? before : after - length;
        high = first ? before + length : after;
    }
    double best = -1e300, sum = 0, length = 0, left = 1;
    std::array<double, 4> light{};
    for (std::int64_t n = 0; n < w.volume.extent.z; ++n) {
        const std::int64_t k = w.backwards ? w.volume.extent.z - 1 - n : n;
        if (k < low || k > high) continue;
        const double begin = k - 1 < low ? low : k - 0.5, end = k + 1 > high ? high : k + 0.5;
        const double value =
            w.volume.values(sampled(w.volume, w.hold, i + w.x + k * w.dx, j + w.y + k * w.dy, k));
        if (!std::isfinite(value)) continue;
        best = std::max(best, value);
        sum += (end - begin) * value;
        length += end - begin;
        const double f = std::clamp((value - 20) / 180, 0.0, 1.0);
        const double opacity = 1 - std::pow(1 - 0.3 * f, (end - begin) * w.with.step);
        const double color[3] = {1 - 0.8 * f, 0.8 * f, 0.5 * f};
        for (int c = 0; c < 3; ++c) light[c] += left * opacity * color[c];
        left *= 1 - opacity;
    }
    if (w.with.rule == Combine::max) return {best > -1e300 ? best : w.with.miss};
    if (w.with.rule == Combine::mean) return {length > 0 ? sum / length : w.with.miss};
    if (w.with.rule == Combine::sum)
        return {(sum - w.with.zero * length) * w.with.step * w.with.unit};
    light[3] = 1 - left;
    return light;
}

const Combine kRules[] = {Combine::max, Combine::sum, Combine::mean, Combine::over};

void expect_reference(ShearWarp warp) {
    const Optics optics = optics_of(kPoints, 1, warp.volume.values);
    warp.with.values = warp.volume.values;
    warp.with.optics = &optics;
    const Tile tile{-25, -18, 90, 55};
    for (const Combine rule : kRules) {
        warp.with.rule = rule;
        const int channels = rule == Combine::over ? 4 : 1;
        const auto out = picture_of(warp, tile);
        double worst = 0;
        for (std::int64_t j = 0; j < tile.height; ++j)
            for (std::int64_t i = 0; i < tile.width; ++i) {
                const auto want = reference(warp, tile.i + i, tile.j + j);
                for (int c = 0; c < channels; ++c)
                    worst = std::max(worst,
                                     std::abs(out[(j * tile.width + i) * channels + c] - want[c]));
            }
        // Values up to 250 in f32; 34 slices of them in a sum. The largest of bytes is found in
        // 1/128 of a level, with three roundings of products of half of that and of weights.
        const bool bytes = warp.volume.type == Type::u8 || warp.volume.type == Type::i8;
        const double level = std::abs(warp.volume.values.slope);
        EXPECT_LE(worst, rule == Combine::max && bytes && warp.hold == Hold::foh ? level / 64
                         : rule == Combine::sum                                  ? 1e-2
                         : rule == Combine::over                                 ? 5e-6
                                                                                 : 1e-4)
            << "rule " << static_cast<int>(rule) << " type " << name_of(warp.volume.type);
    }
}

TEST(ShearWarpKernel, EveryTypeAndShearEqualsTheReference) {
    const Extent n{41, 23, 34};
    const auto u8 = random_samples<std::uint8_t>(n, 1);
    const auto i8 = random_samples<std::int8_t>(n, 2);
    const auto u16 = random_samples<std::uint16_t>(n, 3);
    const auto i16 = random_samples<std::int16_t>(n, 4);
    const auto f32 = random_samples<float>(n, 5);
    const auto f64 = random_samples<double>(n, 6);
    const Grid grids[] = {
        {u8.data(), Type::u8, n, 1, {}},   {i8.data(), Type::i8, n, 1, {2, -1}},
        {u16.data(), Type::u16, n, 1, {}}, {i16.data(), Type::i16, n, 1, {-2, 240}},
        {f32.data(), Type::f32, n, 1, {}}, {f64.data(), Type::f64, n, 1, {}}};
    for (const Grid& grid : grids)
        for (const Hold hold : {Hold::zoh, Hold::foh})
            for (const bool backwards : {false, true}) {
                ShearWarp warp{.volume = grid,
                               .hold = hold,
                               .with = {.step = 1.21, .unit = 0.5, .zero = 2, .miss = -4}};
                warp.backwards = backwards;
                warp.x = -3.3, warp.dx = 0.37, warp.y = 4.71, warp.dy = -0.53;
                expect_reference(warp);
                warp.x = 0, warp.dx = 0, warp.y = 0, warp.dy = 0;
                expect_reference(warp);
                warp.dx = -1, warp.dy = 1;
                expect_reference(warp);
            }
}

/// Tiles of more than one block of registers, and faces exactly between samples.
TEST(ShearWarpKernel, LargestOfWideTilesEqualsTheReference) {
    const Extent n{150, 37, 45};
    const auto u8 = random_samples<std::uint8_t>(n, 10);
    const auto i16 = random_samples<std::int16_t>(n, 11);
    const Tile tile{-30, -20, 230, 83};
    const std::array<double, 4> shears[] = {// x, dx, y, dy
                                            {-3.3, 0.37, 4.71, -0.53},
                                            {0.5, -0.5, -0.5, 0.25},
                                            {0.5, 0, 0.5, 0},
                                            {0.25, 1, 0, -1}};
    for (const Grid& grid :
         {Grid{u8.data(), Type::u8, n, 1, {}}, Grid{u8.data(), Type::u8, n, 1, {-1, 120}},
          Grid{i16.data(), Type::i16, n, 1, {}}})
        for (const Hold hold : {Hold::zoh, Hold::foh})
            for (const auto& [x, dx, y, dy] : shears) {
                ShearWarp warp{.volume = grid, .hold = hold, .with = {.miss = -4}};
                warp.with.values = grid.values;
                warp.x = x, warp.dx = dx, warp.y = y, warp.dy = dy;
                const auto out = picture_of(warp, tile);
                double worst = 0;
                for (std::int64_t j = 0; j < tile.height; ++j)
                    for (std::int64_t i = 0; i < tile.width; ++i)
                        worst =
                            std::max(worst, std::abs(out[j * tile.width + i] -
                                                     reference(warp, tile.i + i, tile.j + j)[0]));
                EXPECT_LE(worst, grid.type == Type::u8 && hold == Hold::foh ? 1.0 / 64 : 1e-4)
                    << name_of(grid.type) << " dx " << dx;
            }
}

/// One slice, of which the light is the opacity: small ones must not drown in 1 - (1 - a)^power.
TEST(ShearWarpKernel, OpacitiesOverOtherLengthsKeepTheirDigits) {
    const Extent n{256, 1, 1};
    std::vector<float> samples(n.samples() + kSlack);
    for (std::int64_t i = 0; i < n.x; ++i) samples[i] = static_cast<float>(i);
    ShearWarp warp{.volume = {samples.data(), Type::f32, n, 1, {}}, .hold = Hold::zoh, .with = {}};
    warp.with.rule = Combine::over;
    for (const double most : {1e-7, 1e-3, 0.29, 0.5, 1.0})
        for (const double step : {0.01, 0.25, 0.5, 1.5, 2.0, 30.0}) {
            const std::vector<OpticsPoint> points = {{0, 0, {1, 1, 1}}, {255, most, {1, 1, 1}}};
            const Optics optics = optics_of(points, 1, warp.volume.values);
            warp.with.optics = &optics;
            warp.with.step = step;
            const auto out = picture_of(warp, {0, 0, n.x, 1});
            for (std::int64_t i = 0; i < n.x; ++i) {
                const double opacity = most * static_cast<double>(i) / 255;
                const double want = opacity < 1 ? -std::expm1(step * std::log1p(-opacity)) : 1;
                // Three roundings of the opacity, magnified, and those of logarithm and
                // exponential.
                const double magnified =
                    want > 0 ? opacity * step * std::pow(1 - opacity, step - 1) / want : 0;
                const double slip = opacity < 1 ? 3 * 0x1p-24 * magnified + 2.5 * 0x1p-23 : 0x1p-23;
                EXPECT_NEAR(out[4 * i], want, slip * want)
                    << "opacity " << opacity << " step " << step;
            }
        }
}

TEST(ShearWarpKernel, ThinVolumesEqualTheReference) {
    for (const Extent& n : {Extent{1, 1, 1}, Extent{20, 9, 1}, Extent{1, 9, 9}, Extent{9, 1, 7}}) {
        const auto f32 = random_samples<float>(n, 7);
        for (const Hold hold : {Hold::zoh, Hold::foh}) {
            ShearWarp warp{.volume = {f32.data(), Type::f32, n, 1, {}}, .hold = hold, .with = {}};
            warp.x = 0.21, warp.dx = 0.17, warp.y = -0.13, warp.dy = 0.41;
            expect_reference(warp);
        }
    }
}

TEST(ShearWarpKernel, NotFiniteSamplesSpreadNoFartherThanTheirTaps) {
    const Extent n{21, 19, 8};
    auto f32 = random_samples<float>(n, 8);
    for (std::int64_t k = 0; k < n.z; ++k) {
        f32[(k * n.y + 4) * n.x] = std::numeric_limits<float>::quiet_NaN();
        f32[(k * n.y + 9) * n.x + 7] = std::numeric_limits<float>::infinity();
    }
    ShearWarp warp{.volume = {f32.data(), Type::f32, n, 1, {}}, .with = {}};
    expect_reference(warp);
    warp.x = 0.25, warp.dy = 0.5;
    expect_reference(warp);
}

TEST(ShearWarpKernel, NothingIsReadBeyondTheLastSampleWherePlacesAreRounded) {
    const Extent n{2, 3, 4};
    std::vector<float> f32(n.samples() + kSlack, std::numeric_limits<float>::quiet_NaN());
    std::fill_n(f32.begin(), n.samples(), 3.0f);
    ShearWarp warp{.volume = {f32.data(), Type::f32, n, 1, {}}, .with = {.rule = Combine::sum}};
    warp.x = 1e-17;
    for (const float value : picture_of(warp, {0, 0, 2, 3})) EXPECT_EQ(value, 12);
}

TEST(ShearWarpKernel, ConstantsKeepTheirChord) {
    const Extent n{30, 30, 25};
    std::vector<float> f32(n.samples() + kSlack, 3.0f);
    ShearWarp warp{.volume = {f32.data(), Type::f32, n, 1, {}}, .with = {.rule = Combine::sum}};
    warp.x = -8.3, warp.dx = 0.71, warp.y = 5.4, warp.dy = -0.44;
    const Tile tile{-20, -20, 70, 70};
    const auto out = picture_of(warp, tile);
    for (std::int64_t j = 0; j < tile.height; ++j)
        for (std::int64_t i = 0; i < tile.width; ++i) {
            float low, high;
            shear_spans(warp, tile.i + i, tile.j + j, 1, 1, &low, &high, 16);
            EXPECT_NEAR(out[j * tile.width + i], low < high ? 3 * (high - low) : 0, 2e-5);
        }
}

TEST(ShearWarpKernel, TilesShowNowhere) {
    const Extent n{60, 40, 50};
    const auto u16 = random_samples<std::uint16_t>(n, 9);
    const auto u8 = random_samples<std::uint8_t>(n, 12);
    const Optics optics = optics_of(kPoints, 1, {});
    for (int run = 0; run < 5; ++run) {
        const Combine rule = kRules[run % 4];
        const Grid grid =
            run < 4 ? Grid{u16.data(), Type::u16, n, 1, {}} : Grid{u8.data(), Type::u8, n, 1, {}};
        ShearWarp warp{.volume = grid,
                       .with = {.rule = rule, .optics = &optics, .bound = 1.0 / 1024}};
        warp.x = -3.3, warp.dx = 0.37, warp.y = 4.71, warp.dy = -0.53;
        const Tile all{-20, -20, 97, 83};
        const int channels = rule == Combine::over ? 4 : 1;
        const auto whole = picture_of(warp, all);
        for (std::int64_t y = 0; y < all.height; y += 9)
            for (std::int64_t x = 0; x < all.width; x += 23) {
                const Tile tile{all.i + x, all.j + y, std::min<std::int64_t>(23, all.width - x),
                                std::min<std::int64_t>(9, all.height - y)};
                const auto part = picture_of(warp, tile);
                for (std::int64_t r = 0; r < tile.height; ++r)
                    ASSERT_EQ(0, std::memcmp(part.data() + r * tile.width * channels,
                                             whole.data() + ((y + r) * all.width + x) * channels,
                                             tile.width * channels * sizeof(float)));
            }
    }
}

}  // namespace
}  // namespace edgewise::kernels
