#include "transitions/kernels/spectrum_picture.hpp"

#include <cmath>
#include <complex>
#include <gtest/gtest.h>
#include <random>

#include "tests/transitions/kernels/spectrum_testing.hpp"

namespace edgewise::kernels {
namespace {

TEST(Fourier, GoodLengthsHaveSmallFactors) {
    EXPECT_EQ(good_length(1), 1);
    EXPECT_EQ(good_length(11), 12);
    EXPECT_EQ(good_length(319), 320);
    EXPECT_EQ(good_length(121), 125);
    EXPECT_EQ(good_length(121, 2), 126);
}

TEST(PicturePeriod, KeepsRepetitionsOutside) {
    for (const auto& [extent, from, to] :
         {std::tuple{100, 10., 90.}, {100, -60., 30.}, {100, 70., 160.}, {100, -400., 500.}}) {
        const auto period = static_cast<double>(picture_period(extent, from, to));
        EXPECT_GE(period, extent);
        EXPECT_LT(to - period, 0);
        EXPECT_GT(from + period, extent - 1);
        EXPECT_LT(period, 1.15 * std::max({extent + 0., to + 4, extent - from + 3}) + 2);
    }
    EXPECT_EQ(picture_period(100, 500, 9000), 100);  // nothing to see
}

TEST(Picture, IsTheInverseTransform) {
    for (const Extent period : {Extent{12, 10, 1}, Extent{15, 7, 1}}) {
        const Extent picture{9, 6, 1};
        std::mt19937 random(3);
        std::vector<float> values(period.samples());
        for (float& value : values) value = static_cast<float>(random()) * 0x1p-32f;
        std::vector<Complex> slice((period.x / 2 + 1) * period.y);
        for (std::int64_t v = 0; v < period.y; ++v)
            for (std::int64_t u = 0; u <= period.x / 2; ++u) {
                std::complex<double> sum = 0;
                for (std::int64_t y = 0; y < period.y; ++y)
                    for (std::int64_t x = 0; x < period.x; ++x)
                        sum += std::polar<double>(
                            values[y * period.x + x],
                            -2 * kPi *
                                (static_cast<double>(u * x) / static_cast<double>(period.x) +
                                 static_cast<double>(v * y) / static_cast<double>(period.y)));
                slice[v * (period.x / 2 + 1) + u] = Complex(sum);
            }
        std::vector<float> out(picture.samples());
        picture_of_slice(slice.data(), period, picture, out.data(), kMemory, {});
        for (std::int64_t y = 0; y < picture.y; ++y)
            for (std::int64_t x = 0; x < picture.x; ++x)
                EXPECT_NEAR(out[y * picture.x + x] / static_cast<float>(period.samples()),
                            values[y * period.x + x], 1e-6);
    }
}

TEST(Chord, IsTheLengthInsideTheBox) {
    const Extent extent{12, 9, 7};
    for (const std::array<double, 3> angles :
         {std::array<double, 3>{0, 0, 0}, {0.4, -0.7, 0.3}, {kPi / 2, 0, 0}}) {
        const std::array<double, 3> scale{1, 1.5, 2};
        const Affine m = turned(extent, angles, scale, 10, 10), back = back_of(m, scale);
        const Chord chord(extent, m);
        for (double y = 0.25; y < 20; y += 2.5)
            for (double x = 0.25; x < 20; x += 2.5) {
                double length = 0;
                for (double z = -30 + 1. / 64; z < 30; z += 1. / 32) {
                    const auto p = apply(back, x, y, z);
                    const bool inside = p[0] >= -0.5 && p[0] <= 11.5 && p[1] >= -0.5 &&
                                        p[1] <= 8.5 && p[2] >= -0.5 && p[2] <= 6.5;
                    length += inside ? 1. / 32 : 0;
                }
                EXPECT_NEAR(chord.at(x, y), length, 1. / 16);  // a step at each end
            }
    }
}

}  // namespace
}  // namespace edgewise::kernels
