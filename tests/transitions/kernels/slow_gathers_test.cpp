#include "transitions/kernels/slow_gathers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <hwy/highway.h>
#include <random>
#include <vector>

#include "tests/vectors.hpp"
#include "transitions/kernels/backward.hpp"
#include "transitions/kernels/permutation.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/warp/shear_chain.hpp"

namespace edgewise::kernels {
namespace {

constexpr Type kTypes[] = {Type::u8, Type::i8, Type::u16, Type::i16, Type::f32};
constexpr Hold kHolds[] = {Hold::zoh, Hold::foh, Hold::bspline3};

/// Any bits, of f32 finite ones.
struct Samples {
    std::vector<std::uint8_t> bytes;
    Grid grid;

    Samples(Extent extent, Type type) : bytes(extent.samples() * bytes_of(type) + kSlack) {
        std::mt19937 random(7);
        for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
        if (type == Type::f32)
            for (std::int64_t i = 0; i < extent.samples(); ++i) {
                const float value = static_cast<float>(random()) * 1e-7f;
                std::memcpy(bytes.data() + 4 * i, &value, 4);
            }
        grid = {.samples = bytes.data(), .type = type, .extent = extent, .values = {}};
    }
};

class SlowGathers : public testing::TestWithParam<std::int64_t> {
 protected:
    void SetUp() override {
        if (GetParam() && !has_vectors(GetParam())) GTEST_SKIP();
        choose_vectors(GetParam());
    }
    void TearDown() override {
        choose_vectors(0);
        set_gathers_slow(std::nullopt);
    }
    /// Makes the floats in both ways.
    static void expect_same(std::size_t floats, const std::function<void(float*)>& make) {
        std::vector<float> gathered(floats, -1.0f), loaded(floats, -2.0f);
        set_gathers_slow(false);
        make(gathered.data());
        set_gathers_slow(true);
        make(loaded.data());
        EXPECT_EQ(0, std::memcmp(gathered.data(), loaded.data(), floats * sizeof(float)));
    }
};
constexpr std::int64_t kTargets[] = {0, HWY_AVX2};
INSTANTIATE_TEST_SUITE_P(Vectors, SlowGathers, testing::ValuesIn(kTargets));

TEST_P(SlowGathers, AreAnsweredAsSetAndElseAlwaysAlike) {
    for (const bool slow : {true, false}) {
        set_gathers_slow(slow);
        EXPECT_EQ(gathers_are_slow(), slow);
    }
    set_gathers_slow(std::nullopt);
    const bool measured = gathers_are_slow();
    for (int i = 0; i < 100; ++i) EXPECT_EQ(gathers_are_slow(), measured);
}

TEST_P(SlowGathers, ChangeNoByteOfRays) {
    const Optics optics = optics_of(
        std::array{OpticsPoint{0, 0, {0, 0, 0}}, OpticsPoint{99, 0.1, {1, 0.5, 0}}}, 1, {});
    for (const Extent& n : {Extent{23, 18, 31}, Extent{9, 1, 14}})
        for (const Type type : kTypes)
            for (const Hold hold : kHolds)
                for (const Combine rule : {Combine::max, Combine::sum, Combine::over}) {
                    const Samples samples(n, type);
                    Rays rays;
                    rays.origin = {.base = {-3, 1.3, -8}, .x = {0.8, 0.1, 0}, .y = {-0.2, 0.7, 0}};
                    rays.direction.base = {0.3, -0.2, 0.93};
                    const RayCast cast{.volume = samples.grid,
                                       .hold = hold,
                                       .rule = rule,
                                       .rays = rays,
                                       .optics = &optics};
                    const int channels = rule == Combine::over ? 4 : 1;
                    expect_same(33 * 29 * channels, [&](float* picture) {
                        ray_cast(cast, 0, 0, 33, 29, picture, 33 * channels);
                    });
                }
}

TEST_P(SlowGathers, ChangeNoByteOfBackwardWarps) {
    const double c = std::cos(0.4), s = std::sin(0.4);
    const Affine turn{c, -s, 0.1, 4, s, c, -0.2, -2, 0.2, 0.1, 0.9, 1.5};
    const Affine flat{c, -s, 0, 4, s, c, 0, -2, 0, 0, 1, 0};
    for (const Extent& n : {Extent{40, 33, 12}, Extent{75, 64, 1}})
        for (const Type type : kTypes)
            for (const Hold hold : kHolds) {
                const Samples samples(n, type);
                const BackwardWarp warp(samples.grid, n.z == 1 ? flat : turn, hold, -7);
                expect_same(n.samples(), [&](float* out) {
                    const Region all{{0, 0, 0}, {n.x, n.y, n.z}};
                    warp({.samples = out, .held = all}, all);
                });
            }
}

TEST_P(SlowGathers, ChangeNoByteOfPermutations) {
    const double c = std::cos(0.4), s = std::sin(0.4);
    for (const Extent& n : {Extent{40, 33, 12}, Extent{75, 64, 1}})
        for (const Type type : kTypes)
            for (const Send send : {Send::me, Send::zoh, Send::foh}) {
                const Samples samples(n, type);
                const Affine turn{c, -s, 0, 9, s, c, 0, -2, 0, 0, 1, 0};
                const PermutationWarp warp(samples.grid, *shear_chain(turn), send, n);
                expect_same(n.samples(), [&](float* out) {
                    std::fill_n(out, n.samples(), -7.0f);
                    warp(warp.sites(), out);
                });
            }
}

}  // namespace
}  // namespace edgewise::kernels
