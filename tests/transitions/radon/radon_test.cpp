// Every edge of the radon job beside integrals and counts written out in f64, and beside what is
// known of a Gaussian and a disc.
#include "graph/radon.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <numbers>
#include <oneapi/tbb/global_control.h>
#include <random>
#include <string>
#include <vector>

#include "graph/with_type.hpp"
#include "transitions/radon/backward.hpp"
#include "transitions/radon/forward.hpp"
#include "transitions/radon/fourier.hpp"
#include "transitions/radon/hough_backward.hpp"
#include "transitions/radon/hough_forward.hpp"

namespace edgewise {
namespace {

using To = RadonSetting::To;

/// A job with its data, as the engine would make it.
struct RadonCase {
    Request want;
    Scene scene;
    Data in;

    /// @param value  of sample (x, y, z)
    RadonCase(const Extent& extent, Type type, const RadonSetting& setting,
              const std::function<double(std::int64_t, std::int64_t, std::int64_t)>& value,
              std::array<double, 2> spacing = {1, 1}) {
        want.job = radon_job();
        want.axes = extent.z == 1 ? 2 : 3;
        want.input = extent;
        want.spacing = {spacing[0], spacing[1], 1};
        want.setting = JobSetting::of(setting);
        Representation what;
        what.extent = extent;
        what.axes = want.axes;
        what.type = type;
        in = Data::make(what, std::pmr::new_delete_resource());
        scene.low = INFINITY, scene.high = -INFINITY, scene.commonest = 0.5;
        for (std::int64_t z = 0; z < extent.z; ++z)
            for (std::int64_t y = 0; y < extent.y; ++y)
                for (std::int64_t x = 0; x < extent.x; ++x)
                    with_type(type, [&]<class T>(T) {
                        *in.at<T>(x, y, z) = static_cast<T>(value(x, y, z));
                        const auto stored = static_cast<double>(*in.at<T>(x, y, z));
                        if (!std::isfinite(stored)) {
                            ++scene.non_finite;
                            return;
                        }
                        scene.low = std::min(scene.low, stored);
                        scene.high = std::max(scene.high, stored);
                    });
    }
    const RadonSetting& setting() const { return *want.setting.as<RadonSetting>(); }
    RadonLines lines() const {
        return {want.input, {want.spacing[0], want.spacing[1]}, setting().angles};
    }
    Ask ask() const { return {want, scene}; }
    /// A sample; 0 beyond the image.
    double at(std::int64_t x, std::int64_t y, std::int64_t z = 0) const {
        if (x < 0 || y < 0 || x >= want.input.x || y >= want.input.y) return 0;
        return with_type(in.what.type, [&]<class T>(T) { return double(*in.at<T>(x, y, z)); });
    }
};

Parameters parameters_of(const Transition& edge) {
    Parameters with;
    for (const auto& [key, domain] : edge.parameters) with.set(key, domain.tried.at(0));
    return with;
}

Data made_by(const Transition& edge, const RadonCase& of) {
    const Offer offer = edge.offer(of.in.what, of.ask(), parameters_of(edge));
    EXPECT_EQ(offer.refused, "") << edge.name;
    Data out = Data::make(offer.to, std::pmr::new_delete_resource());
    Context context{.memory = std::pmr::new_delete_resource()};
    edge.run(offer, of.ask(), of.in, out, Region::all(offer.to.extent), context);
    return out;
}

/// The bilinear field, 0 from one sample beyond the outermost centres on.
double field(const RadonCase& of, double x, double y, std::int64_t z) {
    const double left = std::floor(x), top = std::floor(y), u = x - left, v = y - top;
    const auto i = static_cast<std::int64_t>(left), j = static_cast<std::int64_t>(top);
    double sum = 0;
    const double weights[] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
    for (int k = 0; k < 4; ++k)
        if (weights[k] > 0) sum += weights[k] * of.at(i + k % 2, j + k / 2, z);
    return sum;
}

/// Its integral along a line, straight from the definition: between any two places where the line
/// crosses the grid the field is a parabola, which Simpson's rule integrates.
double integral(const RadonCase& of, int k, std::int64_t m, std::int64_t z = 0) {
    const double angle = std::numbers::pi * k / of.setting().angles;
    const double c = std::cos(angle), s = std::sin(angle);
    const double sx = of.want.spacing[0], sy = of.want.spacing[1];
    const std::int64_t nx = of.want.input.x, ny = of.want.input.y;
    const double step = std::min(sx, sy);
    const auto half = static_cast<std::int64_t>(
        std::ceil(std::hypot(double(nx + 1) * sx, double(ny + 1) * sy) / (2 * step)));
    const double offset = double(m - half) * step;
    // With y down a line of offset r holds r (c, -s) + t (s, c).
    const double x0 = offset * c / sx + 0.5 * double(nx - 1), dx = s / sx;
    const double y0 = -offset * s / sy + 0.5 * double(ny - 1), dy = c / sy;
    std::vector<double> cuts;
    for (std::int64_t i = -1; i <= nx; ++i)
        if (std::abs(dx) > 1e-12) cuts.push_back((double(i) - x0) / dx);
    for (std::int64_t j = -1; j <= ny; ++j)
        if (std::abs(dy) > 1e-12) cuts.push_back((double(j) - y0) / dy);
    std::sort(cuts.begin(), cuts.end());
    double sum = 0;
    for (std::size_t i = 1; i < cuts.size(); ++i) {
        const double from = cuts[i - 1], to = cuts[i], third[] = {from, (from + to) / 2, to};
        for (int p = 0; p < 3; ++p)
            sum += (to - from) / 6 * (p == 1 ? 4 : 1) *
                   field(of, x0 + third[p] * dx, y0 + third[p] * dy, z);
    }
    return sum;
}

/// For which line a sample votes.
std::int64_t vote(const RadonCase& of, int k, std::int64_t x, std::int64_t y) {
    const RadonLines lines = of.lines();
    const auto [c, s] = radon_direction(k, of.setting().angles);
    const double a = c * of.want.spacing[0] / lines.step,
                 b = -(s * of.want.spacing[1] / lines.step);
    const double offset = (double(x) - 0.5 * double(of.want.input.x - 1)) * a +
                          (double(y) - 0.5 * double(of.want.input.y - 1)) * b;
    return std::int64_t(std::floor(offset + (double(lines.middle()) + 0.5)));
}

const std::vector<Extent>& shapes() {
    static const std::vector<Extent> all{{1, 1, 1}, {1, 7, 1},  {9, 1, 1},   {2, 2, 1},
                                         {3, 2, 1}, {16, 9, 1}, {13, 20, 1}, {5, 4, 3}};
    return all;
}

TEST(Radon, DirectionsAreExactAlongAxesAndDiagonals) {
    EXPECT_EQ(radon_direction(0, 7), (std::array<double, 2>{1, 0}));
    EXPECT_EQ(radon_direction(90, 180), (std::array<double, 2>{0, 1}));
    const auto up = radon_direction(45, 180), down = radon_direction(135, 180);
    EXPECT_EQ(up[0], up[1]);
    EXPECT_EQ(down[0], -down[1]);
    // The argument below is rounded three times, to 2^-53 of pi at most.
    for (int k = 0; k < 997; ++k) {
        const auto [c, s] = radon_direction(k, 997);
        ASSERT_NEAR(c, std::cos(std::numbers::pi * k / 997), 1.1e-15);
        ASSERT_NEAR(s, std::sin(std::numbers::pi * k / 997), 1.1e-15);
    }
}

TEST(Radon, IntegralsAreThoseOfTheBilinearField) {
    std::mt19937 random(3);
    for (const Extent& extent : shapes())
        for (const Type type : {Type::u8, Type::f32})
            for (const std::array<double, 2> spacing :
                 {std::array<double, 2>{1, 1}, {0.4, 0.4}, {2.5, 0.7}, {0.3, 3}}) {
                const RadonCase of(
                    extent, type, {.angles = 1 + int(random() % 24)},
                    [&](auto, auto, auto) {
                        return double(random() % 200) - (type == Type::f32 ? 80.5 : 0);
                    },
                    spacing);
                const RadonLines lines = of.lines();
                for (const Transition& edge : {radon_backward(), radon_forward()}) {
                    const Data out = made_by(edge, of);
                    ASSERT_EQ(out.what.extent, (Extent{lines.offsets, lines.angles, extent.z}));
                    // Stored in 24 bits; sums in f64 are off by far less.
                    const double most = 200 * lines.diagonal * 0x1p-24;
                    for (std::int64_t z = 0; z < extent.z; ++z)
                        for (int k = 0; k < lines.angles; ++k)
                            for (std::int64_t m = 0; m < lines.offsets; ++m)
                                ASSERT_NEAR(*out.at<float>(m, k, z), integral(of, k, m, z), most)
                                    << edge.name << " angle " << k << " of " << lines.angles
                                    << " line " << m << " of " << lines.offsets << ", image "
                                    << extent.x << 'x' << extent.y;
                }
            }
}

TEST(Radon, OfAGaussianEveryAngleIsAGaussian) {
    // Samples of a Gaussian of variance v, spread by pyramids of variance 1/6 along any direction:
    // a Gaussian of their sum, but for the pyramids' fourth cumulant, -1/60 at most, whose term is
    // below 3 / (24 60 v^2) of the top; where no line runs along rows or columns. There it meets
    // samples and the middles between them alike from end to end, and linear interpolation is off
    // by up to 1/8 of second derivatives: their integrals along lines are 3 / v of the top at most.
    constexpr double kVariance = 36, kPi = std::numbers::pi;
    const RadonCase of({97, 81, 1}, Type::f32, {.angles = 30}, [](auto x, auto y, auto) {
        return std::exp(-(std::pow(double(x) - 50, 2) + std::pow(double(y) - 38, 2)) /
                        (2 * kVariance));
    });
    const RadonLines lines = of.lines();
    const double variance = kVariance + 1. / 6;
    const double top = 2 * kPi * kVariance / std::sqrt(2 * kPi * variance);
    // What is cut off at the faces, 38 samples from the middle, is below 1e-8.
    const double most = top * (3 / (24 * 60 * kVariance * kVariance) + 2e-7) + 1e-6;
    for (const Transition& edge : {radon_backward(), radon_forward(), radon_fourier()}) {
        const Data out = made_by(edge, of);
        const Error error =
            edge.error(edge.offer(of.in.what, of.ask(), parameters_of(edge)), of.ask());
        const double said = (error.bias + error.noise) * lines.diagonal;
        for (int k = 0; k < lines.angles; ++k)
            for (std::int64_t m = 0; m < lines.offsets; ++m) {
                const double angle = kPi * k / lines.angles;
                // The middle of the Gaussian is (50 - 48, 38 - 40), y down.
                const double at =
                    double(m - lines.middle()) - (2 * std::cos(angle) + 2 * std::sin(angle));
                const bool near_axis = std::abs(std::sin(2 * angle)) < std::sin(23 * kPi / 180);
                const double off = near_axis ? 2. / 8 * 3 / kVariance * top : most;
                ASSERT_NEAR(*out.at<float>(m, k, 0), top * std::exp(-at * at / (2 * variance)),
                            off + said)
                    << edge.name << " angle " << k << " line " << m;
            }
    }
}

TEST(Radon, OfADiscLinesAreChords) {
    constexpr double kRadius = 20;
    const RadonCase of({51, 47, 1}, Type::u8, {.angles = 24}, [](auto x, auto y, auto) {
        return std::hypot(double(x) - 25, double(y) - 23) <= kRadius ? 1. : 0;
    });
    const RadonLines lines = of.lines();
    // A place less than the diagonal of a cell from the disc's edge has samples on both sides;
    // others are 0 or 1. So chords are those of a disc that is by so much smaller or larger.
    const auto chord = [](double radius, double r) {
        return radius > std::abs(r) ? 2 * std::sqrt(radius * radius - r * r) : 0;
    };
    const double cell = std::sqrt(2.0);
    for (const Transition& edge : {radon_backward(), radon_forward(), radon_fourier()}) {
        const Data out = made_by(edge, of);
        const Error error =
            edge.error(edge.offer(of.in.what, of.ask(), parameters_of(edge)), of.ask());
        // Of one line a transform may be off by more than the root of the mean square.
        const double said = 8 * (error.bias + error.noise) * lines.diagonal;
        for (int k = 0; k < lines.angles; ++k)
            for (std::int64_t m = 0; m < lines.offsets; ++m) {
                const double r = double(m - lines.middle());
                ASSERT_GE(*out.at<float>(m, k, 0), chord(kRadius - cell, r) - said);
                ASSERT_LE(*out.at<float>(m, k, 0), chord(kRadius + cell, r) + said)
                    << edge.name << " angle " << k << " line " << m;
            }
    }
}

TEST(Radon, EveryEdgeIsAsFarOffAsItSays) {
    std::mt19937 random(8);
    using Value = std::function<double(std::int64_t, std::int64_t, std::int64_t)>;
    const std::pair<const char*, Value> images[] = {
        {"noise", [&](auto, auto, auto) { return double(random() % 256); }},
        {"two values", [&](auto, auto, auto) { return random() % 2 ? 255. : 0; }},
        {"columns", [](auto x, auto, auto) { return x % 2 ? 255. : 0; }},
        {"rows", [](auto, auto y, auto) { return y % 2 ? 255. : 0; }},
        {"checker", [](auto x, auto y, auto) { return (x + y) % 2 ? 255. : 0; }},
        {"constant", [](auto, auto, auto) { return 200.; }},
        {"one sample", [](auto x, auto y, auto) { return x == 3 && y == 5 ? 255. : 0; }},
        {"square",
         [](auto x, auto y, auto) { return x > 9 && x < 30 && y > 20 && y < 44 ? 250. : 0; }},
    };
    for (const auto& [name, value] : images)
        for (const std::array<double, 2> spacing : {std::array<double, 2>{1, 1}, {1.5, 0.5}}) {
            const RadonCase of({64, 57, 1}, Type::u8, {.angles = 36}, value, spacing);
            const RadonLines lines = of.lines();
            std::vector<double> expected;
            for (int k = 0; k < lines.angles; ++k)
                for (std::int64_t m = 0; m < lines.offsets; ++m)
                    expected.push_back(integral(of, k, m));
            for (const Transition& edge : {radon_backward(), radon_forward(), radon_fourier()}) {
                const Offer offer = edge.offer(of.in.what, of.ask(), parameters_of(edge));
                const Error error = edge.error(offer, of.ask());
                ASSERT_TRUE(error.known);
                const Data out = made_by(edge, of);
                double squares = 0;
                for (std::size_t i = 0; i < expected.size(); ++i)
                    squares += std::pow(out.as<float>()[i] - expected[i], 2);
                const double rms = std::sqrt(squares / double(expected.size())) / lines.diagonal;
                EXPECT_LE(rms, std::hypot(error.bias, error.noise)) << edge.name << ' ' << name;
            }
        }
}

TEST(Hough, VotesAreCountedExactly) {
    std::mt19937 random(4);
    for (const Extent& extent : shapes())
        for (const int angles : {1, 2, 4, 12, 17, 180})
            for (const std::array<double, 2> spacing : {std::array<double, 2>{1, 1}, {0.7, 1.9}}) {
                const RadonCase of(
                    extent, Type::f32, {.angles = angles, .to = To::hough, .threshold = 0.5},
                    [&](auto, auto, auto) {
                        const double values[] = {0, 0.5, 0.49, 1,
                                                 std::numeric_limits<double>::quiet_NaN()};
                        return values[random() % 5];
                    },
                    spacing);
                const RadonLines lines = of.lines();
                std::vector<float> expected(std::size_t(lines.extent().samples()), 0);
                for (std::int64_t z = 0; z < extent.z; ++z)
                    for (std::int64_t y = 0; y < extent.y; ++y)
                        for (std::int64_t x = 0; x < extent.x; ++x)
                            for (int k = 0; k < angles; ++k)
                                if (of.at(x, y, z) >= 0.5)
                                    ++expected[std::size_t((z * angles + k) * lines.offsets +
                                                           vote(of, k, x, y))];
                for (const Transition& edge : {hough_forward(), hough_backward()}) {
                    const Data out = made_by(edge, of);
                    for (std::size_t i = 0; i < expected.size(); ++i)
                        ASSERT_EQ(out.as<float>()[i], expected[i])
                            << edge.name << ' ' << angles << " at " << i;
                }
            }
}

TEST(Hough, OfALineOneCellHasAllVotes) {
    // The diagonal from top left to bottom right: x - y = 0, so at 45 degrees (y up) all have
    // offset 0.
    const RadonCase of({40, 40, 1}, Type::u8, {.angles = 4, .to = To::hough, .threshold = 1},
                       [](auto x, auto y, auto) { return x == y ? 1. : 0; });
    const RadonLines lines = of.lines();
    for (const Transition& edge : {hough_forward(), hough_backward()})
        EXPECT_EQ(*made_by(edge, of).at<float>(lines.middle(), 1, 0), 40) << edge.name;
}

TEST(Radon, WhatIsNotFiniteSpoilsTheLinesThatMeetItAlone) {
    const double spoilt = std::numeric_limits<double>::quiet_NaN();
    const RadonCase of({21, 17, 1}, Type::f32, {.angles = 20},
                       [&](auto x, auto y, auto) { return x == 6 && y == 11 ? spoilt : 1; });
    const RadonLines lines = of.lines();
    for (const Transition& edge : {radon_backward(), radon_forward()}) {
        const Data out = made_by(edge, of);
        for (int k = 0; k < lines.angles; ++k) {
            const auto [c, s] = radon_direction(k, lines.angles);
            const double at = (6 - 10) * c - (11 - 8) * s + double(lines.middle());
            const double reach = std::abs(c) + std::abs(s);
            for (std::int64_t m = 0; m < lines.offsets; ++m) {
                const double off = std::abs(double(m) - at) - reach;
                if (std::abs(off) <= 0.01) continue;
                ASSERT_EQ(std::isnan(*out.at<float>(m, k, 0)), off < 0)
                    << edge.name << " angle " << k << " line " << m;
            }
        }
    }
    const Transition fourier = radon_fourier();
    EXPECT_NE(
        fourier.offer(of.in.what, of.ask(), parameters_of(fourier)).refused.find("not finite"),
        std::string::npos);
}

TEST(Radon, BytesDoNotDependOnThreads) {
    std::mt19937 random(6);
    for (const To to : {To::sinogram, To::hough}) {
        const RadonCase of({70, 90, 1}, Type::u8, {.angles = 50, .to = to, .threshold = 100},
                           [&](auto, auto, auto) { return double(random() % 256); });
        const std::vector<Transition> edges =
            to == To::hough
                ? std::vector<Transition>{hough_forward(), hough_backward()}
                : std::vector<Transition>{radon_backward(), radon_forward(), radon_fourier()};
        for (const Transition& edge : edges) {
            std::vector<Data> outs;
            for (const std::size_t threads : {1u, 4u}) {
                const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                                threads);
                outs.push_back(made_by(edge, of));
            }
            EXPECT_EQ(std::memcmp(outs[0].as<char>(), outs[1].as<char>(), outs[0].samples.bytes()),
                      0)
                << edge.name;
        }
    }
}

TEST(Radon, EdgesRefuseWhatTheyCannotDo) {
    const auto one = [](auto, auto, auto) { return 1.; };
    RadonCase sums({8, 8, 1}, Type::u8, {.angles = 3}, one);
    const RadonCase counts({8, 8, 1}, Type::u8, {.angles = 3, .to = To::hough}, one);
    for (const Transition& edge : {radon_backward(), radon_forward(), radon_fourier()}) {
        const Parameters with = parameters_of(edge);
        EXPECT_NE(edge.offer(counts.in.what, counts.ask(), with).refused, "") << edge.name;
        EXPECT_EQ(edge.offer(sums.in.what, sums.ask(), with).refused, "") << edge.name;
        Representation what = sums.in.what;
        what.channels = 3;
        EXPECT_NE(edge.offer(what, sums.ask(), with).refused, "") << edge.name;
        what = sums.in.what;
        what.extent.x = 4;
        EXPECT_NE(edge.offer(what, sums.ask(), with).refused, "") << edge.name;
    }
    for (const Transition& edge : {hough_forward(), hough_backward()}) {
        EXPECT_NE(edge.offer(sums.in.what, sums.ask(), {}).refused, "") << edge.name;
        EXPECT_EQ(edge.offer(counts.in.what, counts.ask(), {}).refused, "") << edge.name;
    }
    sums.want.setting = {};
    EXPECT_NE(radon_backward().offer(sums.in.what, sums.ask(), {}).refused, "");
}

}  // namespace
}  // namespace edgewise
