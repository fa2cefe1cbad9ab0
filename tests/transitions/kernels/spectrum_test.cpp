#include "transitions/kernels/spectrum.hpp"

#include <cmath>
#include <complex>
#include <gtest/gtest.h>
#include <vector>

#include "tests/transitions/kernels/spectrum_testing.hpp"

namespace edgewise::kernels {
namespace {

TEST(KaiserBessel, WiderWindowAndMorePaddingLeaveFainterGhosts) {
    const auto rms = [](int width, double padding) {
        const KaiserBessel window(width, padding);
        double squares = 0;
        for (int i = 0; i <= 100; ++i) squares += std::pow(window.ghost(i / 200. / padding), 2);
        return std::sqrt(squares / 101);
    };
    EXPECT_LT(rms(4, 1.25), 5e-3);
    EXPECT_LT(rms(6, 1.25), 3e-4);
    EXPECT_LT(rms(4, 1.5), 1.6e-3);
    EXPECT_LT(rms(6, 1.5), 4e-5);
    EXPECT_LT(rms(4, 2), 5e-4);
    EXPECT_LT(rms(6, 2), 6e-6);
}

TEST(TapTable, HoldsTheWindow) {
    const KaiserBessel window(6, 1.25);
    const TapTable& table = TapTable::of(window);
    for (int row = 0; row <= 2 * TapTable::kFractions; ++row)
        for (int tap = 0; tap < 6; ++tap) {
            const int low = std::min(row / 2, TapTable::kFractions - 1);
            const double part = row / 2. - low;
            const double got =
                table.taps[low * 8 + tap] * (1 - part) + table.taps[(low + 1) * 8 + tap] * part;
            EXPECT_NEAR(got, window(row / 512. + 2 - tap), 4e-6);
        }
}

TEST(Spectrum, IsTheTransformOfTheWeightedVolume) {
    // Half of a period has 9, 25 and 16 columns, of which 16 are transformed together; periods of
    // 27 are odd.
    for (const Extent extent :
         {Extent{7, 6, 5}, Extent{8, 1, 3}, Extent{29, 17, 10}, Extent{20, 3, 17}}) {
        const PlainVolume volume = noise(extent, 0);
        const SpectrumShape shape(extent, KaiserBessel(4, 1.5));
        const auto spectrum = spectrum_of(volume, shape);
        const Extent stored = shape.stored();
        const auto origin = shape.origin();
        double largest = 0, scale = 0;
        for (const std::array<std::int64_t, 3> k : {std::array<std::int64_t, 3>{0, 0, 0},
                                                    {3, 2, 1},
                                                    {-2, 5, 15},
                                                    {-4, 0, 3},
                                                    {shape.period.x / 2, 4, 2},
                                                    {shape.period.x / 2 + 7, 1, 15}}) {
            std::complex<double> want = 0;
            for (std::int64_t z = 0; z < extent.z; ++z)
                for (std::int64_t y = 0; y < extent.y; ++y)
                    for (std::int64_t x = 0; x < extent.x; ++x) {
                        const std::int64_t at[3] = {x, y, z};
                        double weight = volume.at(x, y, z), turns = 0;
                        for (int axis = 0; axis < 3; ++axis) {
                            const double r = static_cast<double>(at[axis] - origin[axis]) /
                                             static_cast<double>(shape.period[axis]);
                            weight /= shape.window.transform(r);
                            turns += r * static_cast<double>(k[axis]);
                        }
                        want += std::polar(weight, -2 * kPi * turns);
                    }
            const Complex got = spectrum[(k[2] * stored.y + k[1]) * stored.x + k[0] +
                                         SpectrumShape::kColumnsBefore];
            largest = std::max(largest, std::abs(std::complex<double>(got) - want));
            scale = std::max(scale, std::abs(want));
        }
        EXPECT_LT(largest / scale, 1e-6);  // f32 rounding, 2^-24 a butterfly
    }
}

TEST(Spectrum, ReadsEveryTypeAndItsValues) {
    const Extent extent{5, 4, 3};
    PlainVolume values(extent);
    std::vector<std::int16_t> stored(extent.samples() + 32);
    for (std::int64_t i = 0; i < extent.samples(); ++i) {
        stored[i] = static_cast<std::int16_t>(i * 37 % 50 - 25);
        values.samples[i] = 0.5f * stored[i] + 100.f - 90.f;
    }
    const SpectrumShape shape(extent, KaiserBessel(4, 1.25));
    const auto want = spectrum_of(values, shape);
    std::vector<Complex> got(want.size());
    spectrum_of_volume({stored.data(), Type::i16, extent, 1, {0.5, 100}}, 90, shape, got.data(),
                       kMemory, {});
    for (std::int64_t i = 0; i < shape.stored().samples(); ++i) ASSERT_EQ(got[i], want[i]);
}

}  // namespace
}  // namespace edgewise::kernels
