#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "graph/errors.hpp"
#include "graph/mode.hpp"
#include "graph/request.hpp"

namespace edgewise {
namespace {

constexpr double kLow = -3, kHigh = 7;

/// Values along a ray and the lengths that they hold for.
struct Ray {
    std::vector<double> values, pieces;
};

Ray random_ray(std::mt19937& bits, std::size_t count, double offset = 0) {
    std::uniform_real_distribution<double> value(kLow, kHigh), piece(0.1, 1);
    Ray ray;
    for (std::size_t i = 0; i < count; ++i) {
        ray.values.push_back(offset + value(bits));
        ray.pieces.push_back(piece(bits));
    }
    return ray;
}

Request request_of(Mode mode) {
    Request want;
    want.mode = mode;
    want.zero = -1;
    want.unit = 0.7;
    want.miss = 99;
    want.surface = SurfaceOf{1.5};
    want.transfer = {.points = {{kLow, 0, {0.1, 0.9, 0.2}}, {kHigh, 0.6, {0.8, 0.3, 1}}},
                     .unit = 1.3};
    return want;
}

std::array<double, 4> result_of(const Stretch& stretch, const Request& want) {
    std::array<double, 4> values{};
    stretch.result(want, values.data());
    return values;
}

std::array<double, 4> result_of(const Ray& ray, const Request& want) {
    Stretch stretch = Stretch::empty(want.mode);
    stretch.add(ray.values, ray.pieces.data(), want);
    return result_of(stretch, want);
}

void expect_near(const std::array<double, 4>& a, const std::array<double, 4>& b, double within) {
    for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(a[c], b[c], within) << c;
}

TEST(Modes, HaveNames) {
    for (const Mode mode : modes()) {
        EXPECT_TRUE(mode_named(mode->name) == mode) << mode->name;
        EXPECT_FALSE(mode->help.empty()) << mode->name;
    }
    EXPECT_TRUE(mode_named("MIP") == Mode::mip);
    try {
        mode_named("minp");
        FAIL();
    } catch (const RequestError& error) {
        EXPECT_NE(std::string(error.what()).find("did you mean minip?"), std::string::npos)
            << error.what();
    }
}

TEST(Modes, StretchesJoinInAnyOrder) {
    std::mt19937 bits(1);
    for (const Mode mode : modes()) {
        SCOPED_TRACE(mode->name);
        const Request want = request_of(mode);
        for (int trial = 0; trial < 20; ++trial) {
            const Ray ray = random_ray(bits, 12);
            const auto part = [&](std::size_t from, std::size_t to) {
                Stretch stretch = Stretch::empty(mode);
                stretch.add(std::span(ray.values).subspan(from, to - from), &ray.pieces[from],
                            want);
                return stretch;
            };
            const auto a = static_cast<std::size_t>(trial % 12), b = a + (12 - a) / 2;
            Stretch left = part(0, a), right = part(a, b);
            right.append(part(b, 12), mode);
            left.append(right, mode);
            expect_near(result_of(left, want), result_of(ray, want), 1e-12);
            EXPECT_NEAR(left.length, part(0, 12).length, 1e-12);
        }
    }
}

TEST(Modes, WhatIsNotFiniteIsPassedOver) {
    std::mt19937 bits(2);
    for (const Mode mode : modes()) {
        SCOPED_TRACE(mode->name);
        const Request want = request_of(mode);
        Ray ray = random_ray(bits, 6);
        if (mode->first_hit) continue;  // where a sample is missing a surface is open
        const auto without = result_of(ray, want);
        for (const double hole : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
            ray.values.insert(ray.values.begin() + 2, hole);
            ray.pieces.insert(ray.pieces.begin() + 2, 0.5);
        }
        expect_near(result_of(ray, want), without, 0);
    }
}

TEST(Modes, OfAConstantAreKnown) {
    for (const Mode mode : modes()) {
        SCOPED_TRACE(mode->name);
        const Request want = request_of(mode);
        const double value = 2.5, length = 6;
        const Ray ray{{value, value, value}, {1, 2, 3}};
        const double got = result_of(ray, want)[0];
        if (mode->first_hit)
            EXPECT_EQ(result_of(ray, want)[3], 0);
        else if (mode->takes_level)
            EXPECT_EQ(result_of(ray, want)[3], 1);
        else if (mode->sampled_every > 0)
            EXPECT_EQ(got, 2 * value);
        else if (mode->channels == 4)
            EXPECT_NEAR(result_of(ray, want)[3],
                        1 - std::pow(1 - want.transfer.at(value)[3],
                                     length * want.unit / want.transfer.unit),
                        1e-14);
        else if (mode->name == "drr")
            EXPECT_NEAR(got, std::exp(-0.0206 * length * want.unit * (1 + value / 1000)), 1e-14);
        else if (mode->slices == ModeTraits::Slices::integral)
            EXPECT_NEAR(got, (value - want.zero) * length * want.unit, 1e-14);
        else if (mode->name == "stddev")
            EXPECT_NEAR(got, 0, 1e-14);
        else
            EXPECT_NEAR(got, value, 1e-14);
        // A ray that meets nothing.
        const double miss = result_of(Ray{}, want)[0];
        EXPECT_EQ(miss, mode->name == "drr"                    ? 1
                        : mode->miss == ModeTraits::Miss::zero ? 0
                        : mode->sampled_every > 0              ? 2 * want.miss
                                                               : want.miss);
    }
}

TEST(Modes, ExtremesAndDeviationsAreThoseOfTheSamples) {
    std::mt19937 bits(3);
    for (const double offset : {0.0, 1e6}) {
        const Ray ray = random_ray(bits, 200, offset);
        const auto [low, high] = std::minmax_element(ray.values.begin(), ray.values.end());
        EXPECT_EQ(result_of(ray, request_of(mode_named("mip")))[0], *high);
        EXPECT_EQ(result_of(ray, request_of(mode_named("minip")))[0], *low);
        double length = 0, mean = 0, squares = 0;
        for (std::size_t i = 0; i < 200; ++i) length += ray.pieces[i];
        for (std::size_t i = 0; i < 200; ++i) mean += ray.pieces[i] * ray.values[i] / length;
        for (std::size_t i = 0; i < 200; ++i)
            squares += ray.pieces[i] * std::pow(ray.values[i] - mean, 2);
        EXPECT_NEAR(result_of(ray, request_of(mode_named("stddev")))[0],
                    std::sqrt(squares / length), 1e-9);
    }
}

TEST(Modes, LongerRaysFollowFromShorterOnes) {
    for (const Mode mode : modes()) {
        if (!mode->lengthen) continue;
        SCOPED_TRACE(mode->name);
        const Request want = request_of(mode);
        for (const double factor : {0.25, 1.0, 3.0}) {
            // A constant, whose colour is the same all along.
            const Ray ray{{2, 2, 2}, {1, 0.5, 2}},
                longer{{2, 2, 2}, {factor, 0.5 * factor, 2 * factor}};
            std::array<double, 4> values = result_of(ray, want);
            mode->lengthen(factor, values);
            expect_near(values, result_of(longer, want), 1e-14);
        }
    }
}

TEST(Modes, WhatMayBeLeftOutChangesNothing) {
    std::mt19937 bits(4);
    int left_out = 0;
    for (const Mode mode : modes()) {
        SCOPED_TRACE(mode->name);
        if (!mode->needs) {
            EXPECT_FALSE(mode->kept.empty());
            continue;
        }
        for (const double common : {kLow, -1.0, kHigh}) {
            Request want = request_of(mode);
            want.miss = mode->miss == ModeTraits::Miss::highest ? kHigh : kLow;
            if (!mode->needs(want, common, kLow, kHigh).empty()) continue;
            ++left_out;
            Ray ray = random_ray(bits, 6);
            const auto without = result_of(ray, want);
            ray.values.insert(ray.values.begin() + 3, common);
            ray.pieces.insert(ray.pieces.begin() + 3, 4);
            expect_near(result_of(ray, want), without, 1e-14);
            expect_near(result_of(Ray{{common}, {1}}, want), result_of(Ray{}, want), 1e-14);
        }
    }
    EXPECT_GE(left_out, 4) << "mip, minip, xray and composite leave out one value each";
}

TEST(Modes, TheirLoopsAgreeWithTheirFormInDouble) {
    constexpr int kRays = 5;
    constexpr std::ptrdiff_t kPlane = 16;
    std::mt19937 bits(5);
    int rules = 0;
    for (const Mode mode : modes()) {
        if (mode->combine != Combine::other) continue;
        SCOPED_TRACE(mode->name);
        ASSERT_NE(mode->rule, nullptr);
        ASSERT_LE(mode->rule->planes, RayRule::kMostPlanes);
        ++rules;
        Request want = request_of(mode);
        const ValueMap map{.slope = -0.5, .offset = 3};
        const double miss = mode->miss == ModeTraits::Miss::zero ? 0 : want.miss;
        const RayRule::Setting setting{map, want.unit, want.zero, miss, want.level()};
        std::array<Ray, kRays> rays;
        for (Ray& ray : rays) ray = random_ray(bits, 40);
        rays[1].values[3] = std::nan("");
        rays[2].pieces.assign(40, 0);  // meets nothing
        const auto add = [&](std::size_t from, std::size_t to, float* state) {
            mode->rule->clear(state, kPlane, kRays);
            for (std::size_t i = from; i < to; ++i) {
                std::array<float, kRays> stored, weights;
                for (std::size_t r = 0; r < kRays; ++r) {
                    stored[r] = static_cast<float>((rays[r].values[i] - map.offset) / map.slope);
                    weights[r] = static_cast<float>(rays[r].pieces[i]);
                }
                mode->rule->add(setting, stored.data(), weights.data(), state, kPlane, kRays);
            }
        };
        std::array<float, RayRule::kMostPlanes * kPlane> whole{}, front{}, back{};
        add(0, 40, whole.data());
        add(0, 17, front.data());
        add(17, 40, back.data());
        for (std::size_t r = 0; r < kRays; ++r) {
            mode->rule->join(front.data() + r, kPlane, back.data() + r, kPlane);
            Stretch stretch = Stretch::empty(mode);
            if (r != 2) stretch.add(rays[r].values, rays[r].pieces.data(), want);
            const auto right = result_of(stretch, want);
            // 40 samples of magnitude 10, in f32.
            constexpr double kWithin = 40 * 10 * 0x1p-24;
            ASSERT_EQ(mode->rule->channels, mode->channels);
            for (const auto* state : {&whole, &front}) {
                std::array<float, 4> got{};
                mode->rule->finish(setting, state->data() + r, kPlane, got.data());
                for (int c = 0; c < mode->channels; ++c)
                    EXPECT_NEAR(got[static_cast<std::size_t>(c)],
                                right[static_cast<std::size_t>(c)], kWithin)
                        << r;
            }
        }
    }
    EXPECT_GE(rules, 1);
}

TEST(Modes, TheTwoHighestAreThoseOfTheSamples) {
    std::mt19937 bits(6);
    Ray ray = random_ray(bits, 200);
    const Request want = request_of(mode_named("top2"));
    const double got = result_of(ray, want)[0];
    std::sort(ray.values.begin(), ray.values.end());
    EXPECT_EQ(got, ray.values[199] + ray.values[198]);
    EXPECT_EQ(result_of(Ray{{3}, {0.5}}, want)[0], 3 + want.miss);
}

TEST(Modes, ALevelIsReachedByTheSameNumbersInFloat) {
    std::mt19937 bits(7);
    std::uniform_real_distribution<double> number(-5, 5);
    for (int trial = 0; trial < 1000; ++trial) {
        RayRule::Setting setting;
        setting.values = {.slope = number(bits), .offset = number(bits)};
        // Levels that a stored number has, and that lie between two.
        const auto stored = static_cast<float>(number(bits));
        setting.level = trial % 2 ? number(bits) : setting.values(stored);
        const float level = setting.stored_level();
        for (float near = level, i = 0; i < 5; ++i, near = std::nextafter(near, 1e9F)) {
            const double exact = (setting.level - setting.values.offset) / setting.values.slope;
            const bool reached = setting.values.slope > 0 ? near >= exact : near <= exact;
            EXPECT_EQ(setting.values.slope > 0 ? near >= level : near <= level, reached);
        }
    }
    RayRule::Setting constant;
    constant.values = {.slope = 0, .offset = 2};
    constant.level = 2;
    EXPECT_LE(constant.stored_level(), 0);
    constant.level = 2.5;
    EXPECT_GT(constant.stored_level(), 0);
}

/// Along a ray that is a cubic the surface is where that has its root.
TEST(Modes, ASurfaceIsFoundBetweenSamples) {
    Request want = request_of(mode_named("surface"));
    const auto field = [&](double t) { return want.level() + (t - 0.3137) * (t * t + 0.2) * 3; };
    for (const double step : {0.05, 0.25, 0.9}) {
        double found = -1;
        const AlongRay along{.value = field, .lit = [&](double t) {
                                 found = t;
                                 return Lit{0.25, 0.5};
                             }};
        Stretch front = Stretch::empty(want.mode), behind = front;
        double last = 0;
        for (double t = -1; t < 1.5; t += step) {
            Stretch& to = t < 0.6 ? front : behind;
            if (&to == &behind && behind.length == 0) to.follow(last, field(last), 0, along, want);
            to.follow(t, field(t), step, along, want);
            last = t;
        }
        EXPECT_NEAR(found, 0.3137, 1e-9) << step;
        front.append(behind, want.mode);
        expect_near(result_of(front, want), {0.75, 0.75, 0.75, 1}, 0);
    }
}

/// Where a field jumps the surface lies behind the jump, however near to the level one side is:
/// interpolation alone goes there by tiny steps, and then stops on either side.
TEST(Modes, ASurfaceLiesBehindAJump) {
    Request want = request_of(mode_named("surface"));
    for (const double before : {-1e-9, -1.4e-4, -1.0, -90.0})
        for (const double behind : {0.0, 1e-9, 1.4e-4, 1.0, 87.0})
            for (const double turned : {1.0, -1.0})
                for (const double jump : {0.0171, 0.5, 0.98}) {
                    const double from = turned > 0 ? before : behind;
                    const double to = turned > 0 ? behind : before;
                    const auto field = [&](double t) {
                        return want.level() + (t < jump ? from : to);
                    };
                    double found = -1;
                    const AlongRay along{.value = field, .lit = [&](double t) {
                                             found = t;
                                             return Lit{};
                                         }};
                    Stretch ray = Stretch::empty(want.mode);
                    ray.follow(0, field(0), 0.5, along, want);
                    ray.follow(1, field(1), 0.5, along, want);
                    EXPECT_GE(found, jump) << before << ", " << behind;
                    EXPECT_NEAR(found, jump, 1e-11) << before << ", " << behind;
                }
}

}  // namespace
}  // namespace edgewise
