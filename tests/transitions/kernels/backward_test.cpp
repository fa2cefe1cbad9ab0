#include "transitions/kernels/backward.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace edgewise::kernels {
namespace {

constexpr float kSentinel = -9.25e8f;  // what a sample that is never written still holds
constexpr double kNearTie = 1e-6;      // lanes keep 2^-23 of a sample: the nearest may be either

/// Samples of one type with the slack that kernels may read.
template <class T>
struct Samples {
    Extent extent;
    int channels;
    std::vector<T> stored;

    Samples(Extent e, int c, std::mt19937& random) : extent(e), channels(c) {
        stored.resize(std::size_t(e.samples() * c) + kSlack / sizeof(T) + 1);
        double low = -500, high = 1500;
        if constexpr (std::is_integral_v<T>) {
            low = double(std::numeric_limits<T>::min());
            high = double(std::numeric_limits<T>::max());
        }
        std::uniform_real_distribution<double> draw(low, high);
        for (T& sample : stored) sample = T(draw(random));
    }
    double at(std::int64_t x, std::int64_t y, std::int64_t z, int c) const {
        return double(stored[std::size_t(((z * extent.y + y) * extent.x + x) * channels + c)]);
    }
    double range() const {
        const auto [low, high] = std::minmax_element(stored.begin(), stored.end());
        return double(*high) - double(*low);
    }
    Grid grid(Type type, ValueMap values = {}) const {
        return {stored.data(), type, extent, channels, values};
    }
};

std::int64_t mirror(std::int64_t i, std::int64_t n) {
    while (n > 1 && (i < 0 || i >= n)) i = i < 0 ? -i : 2 * (n - 1) - i;
    return n == 1 ? 0 : i;
}

/// The cubic B-spline by its definition in pieces.
double cubic_spline(double t) {
    t = std::abs(t);
    if (t < 1) return 2.0 / 3 - t * t + t * t * t / 2;
    return t < 2 ? (2 - t) * (2 - t) * (2 - t) / 6 : 0;
}

/// What reads: a hold with code of its own, or a filter by its weights.
struct By {
    Hold hold;
    const Filter* filter = nullptr;

    By(Hold which) : hold(which) {}
    By(const Filter& weights) : hold(Hold::weighted), filter(&weights) {}
};

/// Those of which the weights are told at run time.
std::vector<const Filter*> weighted_filters() {
    std::vector<const Filter*> all;
    for (const Filter& filter : filters())
        if (hold_of(filter) == Hold::weighted) all.push_back(&filter);
    return all;
}

std::vector<By> all_that_read() {
    std::vector<By> all = {Hold::zoh, Hold::foh, Hold::bspline3};
    for (const Filter* filter : weighted_filters()) all.emplace_back(*filter);
    return all;
}

/// Index and weight of every tap along one axis at a position inside.
std::vector<std::pair<std::int64_t, double>> taps(double p, std::int64_t n, const By& by) {
    const Hold hold = by.hold;
    p = std::clamp(p, 0.0, double(n - 1));
    if (hold == Hold::zoh) return {{std::int64_t(std::floor(p + 0.5)), 1.0}};
    std::vector<std::pair<std::int64_t, double>> all;
    const auto cell = std::int64_t(std::floor(p));
    if (by.filter) {
        std::array<double, 8> weights{};
        by.filter->weights(p - double(cell), weights.data());
        for (int tap = 0; tap < by.filter->taps; ++tap)
            all.emplace_back(
                std::clamp<std::int64_t>(cell + tap + 1 - by.filter->taps / 2, 0, n - 1),
                weights[tap]);
        return all;
    }
    for (std::int64_t i = cell - 1; i <= cell + 2; ++i) {
        const double t = p - double(i);
        const double w = hold == Hold::foh ? std::max(0.0, 1 - std::abs(t)) : cubic_spline(t);
        if (w != 0) all.emplace_back(mirror(i, n), w);
    }
    return all;
}

template <class T>
double reference(const Samples<T>& in, const By& hold, const std::array<double, 3>& p,
                 int channel) {
    const bool image = in.extent.z == 1;
    double sum = 0;
    for (const auto& [z, wz] : image ? taps(0, 1, Hold::zoh) : taps(p[2], in.extent.z, hold))
        for (const auto& [y, wy] : taps(p[1], in.extent.y, hold))
            for (const auto& [x, wx] : taps(p[0], in.extent.x, hold))
                sum += wx * wy * wz * in.at(x, y, z, channel);
    return sum;
}

bool inside(const std::array<double, 3>& p, const Extent& n) {
    for (int a = 0; a < (n.z == 1 ? 2 : 3); ++a)
        if (p[a] < -0.5 || p[a] > double(n[a]) - 0.5) return false;
    return true;
}

/// Whether rounding alone decides on which side of an edge a position lies.
bool undecided(const std::array<double, 3>& p, const Extent& n, Hold hold) {
    for (int a = 0; a < (n.z == 1 ? 2 : 3); ++a) {
        if (std::abs(p[a] + 0.5) < 1e-8 || std::abs(p[a] - double(n[a]) + 0.5) < 1e-8) return true;
        const double tie = p[a] + 0.5 - std::round(p[a] + 0.5);
        if (hold == Hold::zoh && std::abs(tie) < kNearTie) return true;
    }
    return false;
}

std::vector<float> warped(const BackwardWarp& warp, const Extent& out, int channels,
                          const Extent& tile) {
    std::vector<float> samples(std::size_t(out.samples() * channels), kSentinel);
    const WarpOutput output{samples.data(), Region::all(out)};
    for (std::int64_t z = 0; z < out.z; z += tile.z)
        for (std::int64_t y = 0; y < out.y; y += tile.y)
            for (std::int64_t x = 0; x < out.x; x += tile.x)
                warp(output, {{x, y, z},
                              {std::min(x + tile.x, out.x), std::min(y + tile.y, out.y),
                               std::min(z + tile.z, out.z)}});
    return samples;
}

/// Output index -> input index: a turn about both centres (degrees), then a scale.
Affine turn(double x, double y, double z, const Extent& in, const Extent& out, double scale = 1) {
    const double f = std::numbers::pi / 180;
    const double cx = std::cos(x * f), sx = std::sin(x * f), cy = std::cos(y * f);
    const double sy = std::sin(y * f), cz = std::cos(z * f), sz = std::sin(z * f);
    const double r[3][3] = {{cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx},
                            {sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx},
                            {-sy, cy * sx, cy * cx}};
    Affine m{};
    for (int i = 0; i < 3; ++i) {
        m[4 * i + 3] = double(in[i] - 1) / 2;
        for (int k = 0; k < 3; ++k) {
            m[4 * i + k] = scale * r[k][i];
            m[4 * i + 3] -= m[4 * i + k] * double(out[k] - 1) / 2;
        }
    }
    return m;
}

struct Geometry {
    Extent in, out, tile;
    double x, y, z, scale;
};

const std::vector<Geometry> kGeometries = {
    {{83, 61, 1}, {90, 70, 1}, {64, 37, 1}, 0, 0, 30, 1},
    {{300, 200, 1}, {310, 250, 1}, {128, 64, 1}, 0, 0, -7.3, 0.7},
    {{17, 1, 1}, {30, 20, 1}, {64, 64, 1}, 0, 0, 133, 0.4},
    {{2, 5, 1}, {33, 31, 1}, {33, 7, 1}, 0, 0, 91, 0.1},
    {{130, 70, 1}, {40, 40, 1}, {16, 16, 1}, 0, 0, 11, 5},
    {{52, 41, 30}, {50, 40, 33}, {50, 7, 9}, 30, 30, 30, 1},
    {{70, 3, 2}, {40, 21, 20}, {64, 16, 16}, 10, -75, 200, 0.3},
    {{64, 64, 64}, {64, 64, 64}, {64, 16, 16}, 1, 2, 3, 1.7},
    {{33, 34, 35}, {90, 20, 20}, {128, 32, 8}, 80, 20, -100, 17},  // beyond the lanes: scalar
};

template <class T>
void expect_reference(Type type, const By& by, double tolerance, int channels = 1) {
    std::mt19937 random(7);
    for (const Geometry& g : kGeometries) {
        const Samples<T> in(g.in, channels, random);
        const Affine m = turn(g.x, g.y, g.z, g.in, g.out, g.scale);
        const ValueMap values{0.5, -3};
        const BackwardWarp warp(in.grid(type, values), m, by.hold, -77, by.filter);
        const std::vector<float> got = warped(warp, g.out, channels, g.tile);
        double worst = 0;
        std::size_t i = 0;
        for (std::int64_t z = 0; z < g.out.z; ++z)
            for (std::int64_t y = 0; y < g.out.y; ++y)
                for (std::int64_t x = 0; x < g.out.x; ++x)
                    for (int c = 0; c < channels; ++c, ++i) {
                        const auto p = apply(m, double(x), double(y), double(z));
                        ASSERT_NE(got[i], kSentinel);
                        if (undecided(p, g.in, by.hold)) continue;
                        const double want = inside(p, g.in) ? values(reference(in, by, p, c)) : -77;
                        worst = std::max(worst, std::abs(got[i] - want));
                    }
        EXPECT_LE(worst, tolerance * in.range() * values.slope)
            << name_of(type) << " " << g.x << "," << g.y << "," << g.z;
    }
}

// zoh: f32 output rounds by 2^-24 of values that reach 1.0001 of half the range about 0 for u32.
// foh: positions are off by 2^-22, so by 2 * 2^-22 * 3 axes of the range at worst: 1.4e-6.
constexpr double kExact = 1.2e-7, kLinear = 1.5e-6;

template <class T>
void expect_both(Type type) {
    expect_reference<T>(type, Hold::zoh, kExact);
    expect_reference<T>(type, Hold::foh, kLinear);
}

TEST(Backward, EveryTypeMatchesTheDefinition) {
    expect_both<std::uint8_t>(Type::u8);
    expect_both<std::int8_t>(Type::i8);
    expect_both<std::uint16_t>(Type::u16);
    expect_both<std::int16_t>(Type::i16);
    expect_both<std::uint32_t>(Type::u32);
    expect_both<std::int32_t>(Type::i32);
    expect_both<float>(Type::f32);
    expect_both<double>(Type::f64);
}

TEST(Backward, CubicSplineMatchesTheDefinition) {
    expect_reference<float>(Type::f32, Hold::bspline3, 3e-6);  // slopes reach 2 ranges a sample
}

TEST(Backward, ChannelsMatchTheDefinition) {
    for (int channels : {2, 3, 4}) {
        expect_reference<std::uint8_t>(Type::u8, Hold::foh, kLinear, channels);
        expect_reference<float>(Type::f32, Hold::zoh, kExact, channels);
    }
}

/// Weights are off by 4e-6 a tap at most, and slopes reach some 3 ranges a sample; the range is
/// less than the magnitude by up to a third.
TEST(Backward, FiltersByTheirWeightsMatchTheDefinition) {
    constexpr double kWeighted = 1e-5;
    // Two of five kinds of samples for each filter, so that each kind comes up with several.
    int next = 0;
    for (const Filter* filter : weighted_filters())
        for (int i = 0; i < 2; ++i, ++next) {
            SCOPED_TRACE(filter->name);
            if (next % 5 == 0) expect_reference<std::uint8_t>(Type::u8, *filter, kWeighted);
            if (next % 5 == 1) expect_reference<std::int16_t>(Type::i16, *filter, kWeighted);
            if (next % 5 == 2) expect_reference<float>(Type::f32, *filter, kWeighted);
            if (next % 5 == 3) expect_reference<std::uint8_t>(Type::u8, *filter, kWeighted, 3);
            if (next % 5 == 4) expect_reference<float>(Type::f32, *filter, kWeighted, 2);
        }
}

template <class T>
void expect_copies(Type type, const By& by) {
    std::mt19937 random(3);
    const Extent n{70, 45, 21};
    Samples<T> in(n, 1, random);
    if constexpr (std::is_floating_point_v<T>) {
        in.stored[1000] = std::numeric_limits<T>::quiet_NaN();
        in.stored[2000] = std::numeric_limits<T>::infinity();
        in.stored[3000] = T(-0.0);
    }
    // A quarter turn about each axis, in f64, where cos(90 degrees) is 6e-17, and a shift.
    for (const auto& [x, y, z, shift] :
         {std::array{0, 0, 0, 0}, {0, 0, 90, 0}, {90, 0, 0, 0}, {0, 270, 180, 0}, {0, 0, 0, 3}}) {
        Extent out = n;
        if (z % 180) std::swap(out.x, out.y);
        if (x % 180) std::swap(out.y, out.z);
        if (y % 180) std::swap(out.x, out.z);
        Affine m = turn(x, y, z, n, out);
        m[3] += shift;
        m[7] -= 2 * shift;
        const BackwardWarp warp(in.grid(type), m, by.hold, 5, by.filter);
        const std::vector<float> got = warped(warp, out, 1, {64, 16, 16});
        std::size_t i = 0;
        for (std::int64_t c = 0; c < out.z; ++c)
            for (std::int64_t b = 0; b < out.y; ++b)
                for (std::int64_t a = 0; a < out.x; ++a, ++i) {
                    const auto p = apply(m, double(a), double(b), double(c));
                    const float want = inside(p, n)
                                           ? float(in.at(std::llround(p[0]), std::llround(p[1]),
                                                         std::llround(p[2]), 0))
                                           : 5;
                    ASSERT_EQ(std::memcmp(&want, &got[i], sizeof want), 0)
                        << want << " " << got[i] << " at " << a << "," << b << "," << c;
                }
    }
}

TEST(Backward, QuarterTurnsAndWholeShiftsCopyBytes) {
    for (const Hold hold : {Hold::zoh, Hold::foh}) {
        expect_copies<std::uint8_t>(Type::u8, hold);
        expect_copies<std::int16_t>(Type::i16, hold);
        expect_copies<float>(Type::f32, hold);
        expect_copies<double>(Type::f64, hold);
    }
    for (const Filter* filter : weighted_filters()) {
        expect_copies<std::uint8_t>(Type::u8, *filter);
        expect_copies<std::int16_t>(Type::i16, *filter);
        expect_copies<float>(Type::f32, *filter);
    }
}

TEST(Backward, RegionsDoNotChangeValues) {
    std::mt19937 random(5);
    const Extent n{210, 160, 1}, out{230, 170, 1};
    const Samples<float> in(n, 1, random);
    for (const By& by : all_that_read()) {
        const BackwardWarp warp(in.grid(Type::f32), turn(0, 0, 33.3, n, out), by.hold, 0,
                                by.filter);
        const auto whole = warped(warp, out, 1, out);
        for (const Extent& tile : {Extent{64, 64, 1}, {33, 7, 1}, {1, 1, 1}, {128, 64, 1}})
            EXPECT_EQ(whole, warped(warp, out, 1, tile));
    }
}

TEST(Backward, OutputMayHoldAPartOfTheScreen) {
    std::mt19937 random(6);
    const Extent n{64, 48, 20}, out{64, 48, 20};
    const Samples<std::uint8_t> in(n, 1, random);
    const BackwardWarp warp(in.grid(Type::u8), turn(10, 20, 30, n, out), Hold::foh, 0);
    const auto whole = warped(warp, out, 1, out);
    const Region part{{3, 5, 7}, {61, 40, 19}};
    std::vector<float> held(std::size_t(part.extent().samples()), kSentinel);
    warp({held.data(), part}, part);
    std::size_t i = 0;
    for (std::int64_t z = part.begin[2]; z < part.end[2]; ++z)
        for (std::int64_t y = part.begin[1]; y < part.end[1]; ++y)
            for (std::int64_t x = part.begin[0]; x < part.end[0]; ++x, ++i)
                ASSERT_EQ(held[i], whole[std::size_t((z * out.y + y) * out.x + x)]);
}

TEST(Backward, LongRowsStayWithinTheTolerance) {
    // Value errors of a white image are position errors times at most two ranges a sample.
    std::mt19937 random(8);
    const Extent n{2048, 2048, 1};
    const Samples<float> in(n, 1, random);
    const Affine m = turn(0, 0, 30, n, n);
    const BackwardWarp warp(in.grid(Type::f32), m, Hold::foh, 0);
    const auto got = warped(warp, n, 1, preferred_tile(n));
    double worst = 0;
    for (std::int64_t y = 0; y < n.y; y += 31)
        for (std::int64_t x = 0; x < n.x; ++x) {
            const auto p = apply(m, double(x), double(y), 0);
            if (undecided(p, n, Hold::foh)) continue;
            const double want = inside(p, n) ? reference(in, Hold::foh, p, 0) : 0;
            worst = std::max(worst, std::abs(got[std::size_t(y * n.x + x)] - want));
        }
    EXPECT_LE(worst, kLinear * in.range());
}

TEST(Backward, NanStaysInTheFootprint) {
    std::mt19937 random(9);
    const Extent n{60, 60, 1};
    Samples<float> in(n, 1, random);
    in.stored[30 * 60 + 30] = std::numeric_limits<float>::quiet_NaN();
    const Affine m = turn(0, 0, 20, n, n);
    for (const Hold hold : {Hold::zoh, Hold::foh, Hold::bspline3}) {
        const auto got = warped({in.grid(Type::f32), m, hold, 0}, n, 1, n);
        const double reach = hold == Hold::zoh ? 0.5 : hold == Hold::foh ? 1 : 2;
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                const auto p = apply(m, double(x), double(y), 0);
                const double far = std::max(std::abs(p[0] - 30), std::abs(p[1] - 30));
                if (far > reach + kNearTie) {
                    ASSERT_TRUE(std::isfinite(got[std::size_t(y * n.x + x)])) << x << " " << y;
                }
            }
    }
}

TEST(Backward, HomographyMatchesTheDefinition) {
    std::mt19937 random(10);
    const Extent n{300, 200, 1};
    const Homography h{1, 0.1, -20, -0.1, 1, 30, -4e-3, 2e-3, 0.71};  // w = 0 crosses the screen
    for (int channels : {1, 3}) {
        const Samples<float> in(n, channels, random);
        for (const By& by : all_that_read()) {
            const double tolerance = (by.filter ? 1e-5 : 3e-6) * in.range();
            const BackwardWarp warp(in.grid(Type::f32), h, by.hold, -4, by.filter);
            const auto got = warped(warp, n, channels, {64, 32, 1});
            int seen = 0;
            std::size_t i = 0;
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x)
                    for (int c = 0; c < channels; ++c, ++i) {
                        ASSERT_NE(got[i], kSentinel);
                        const double w = h[6] * double(x) + h[7] * double(y) + h[8];
                        const std::array<double, 3> p{
                            (h[0] * double(x) + h[1] * double(y) + h[2]) / w,
                            (h[3] * double(x) + h[4] * double(y) + h[5]) / w, 0};
                        if (std::abs(w) < 1e-9 || undecided(p, n, by.hold)) continue;
                        const bool sees = w > 0 && inside(p, n);
                        seen += sees;
                        const double want = sees ? reference(in, by, p, c) : -4;
                        ASSERT_NEAR(got[i], want, tolerance) << x << " " << y;
                    }
            EXPECT_GT(seen, 5000);
        }
    }
}

TEST(Backward, ZeroOrderHoldRoundsHalvesUp) {
    Extent n{8, 1, 1};
    std::mt19937 random(11);
    Samples<std::uint8_t> in(n, 1, random);
    const Affine half{0.5, 0, 0, -0.5, 0, 1, 0, 0, 0, 0, 1, 0};  // -0.5, 0, 0.5, ... 7.5
    const auto got = warped({in.grid(Type::u8), half, Hold::zoh, -1}, {18, 1, 1}, 1, {18, 1, 1});
    for (int x = 0; x < 18; ++x) {
        const double p = 0.5 * x - 0.5;
        const auto nearest = std::int64_t(std::floor(std::clamp(p, 0.0, 7.0) + 0.5));
        EXPECT_EQ(got[std::size_t(x)], p > 7.5 ? -1 : in.at(nearest, 0, 0, 0)) << p;
    }
}

TEST(Backward, HalfPrecisionIsRead) {
    const std::array<std::uint16_t, 40> halves{0x3c00, 0xc000, 0x0001, 0x7bff};  // 1 -2 2^-24 65504
    const Grid grid{halves.data(), Type::f16, {4, 1, 1}, 1, {}};
    const Affine identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const auto got = warped({grid, identity, Hold::foh, 0}, {4, 1, 1}, 1, {4, 1, 1});
    EXPECT_EQ(got, (std::vector<float>{1, -2, 0x1p-24f, 65504}));
}

}  // namespace
}  // namespace edgewise::kernels
