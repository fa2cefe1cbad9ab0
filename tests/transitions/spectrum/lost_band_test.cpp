#include "transitions/spectrum/lost_band.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <memory_resource>
#include <numbers>
#include <random>

namespace edgewise {
namespace {

constexpr double kPi = std::numbers::pi;

template <class Value>
Data volume_of(const Extent& extent, const Value& value) {
    Representation what;
    what.extent = extent;
    Data data = Data::make(what, std::pmr::new_delete_resource());
    for (std::int64_t i = 0; i < extent.samples(); ++i)
        data.as<float>()[i] = static_cast<float>(
            value(i % extent.x, i / extent.x % extent.y, i / (extent.x * extent.y)));
    return data;
}

LostBand band_of(const Data& data, kernels::Between between = kernels::Between::spline) {
    return {data, Region::all(data.what.extent), between};
}

TEST(LostBand, OfWhiteNoiseItIsAnIntegralOverThePlane) {
    std::mt19937 random(3);
    const Data noise =
        volume_of({64, 64, 64}, [&](auto...) { return static_cast<double>(random()) * 0x1p-32; });
    const auto lost = band_of(noise);
    // The plane across (1, 1, 0) / sqrt 2: f = (a, -a, b) with a line element of sqrt 2 along a,
    // which cancels.
    double beyond = 0, difference = 0;
    for (double a = -1.4975; a < 1.5; a += 0.005)
        for (double b = -1.4975; b < 1.5; b += 0.005) {
            const auto sinc = [](double f) { return std::sin(kPi * f) / (kPi * f); };
            const auto spline = [&](double f) {
                return std::pow(sinc(f), 4) * 3 / (2 + std::cos(2 * kPi * f));
            };
            const double s = spline(a) * spline(a) * spline(b),
                         l = std::pow(sinc(a) * sinc(a) * sinc(b), 2);
            if (std::max(std::abs(a), std::abs(b)) > 0.75) beyond += s * s;
            difference += (l - s) * (l - s);
        }
    // The power of 16 bricks is uneven, but the plane has some thousand frequencies.
    EXPECT_NEAR(lost.over_difference({1, 1, 0}), std::sqrt(beyond / difference),
                0.15 * std::sqrt(beyond / difference));
}

TEST(LostBand, OfSmoothSamplesObliqueRaysLoseLittle) {
    const Data smooth = volume_of({64, 64, 64}, [](auto x, auto y, auto z) {
        const double r = std::pow(x - 30.5, 2) + std::pow(y - 32, 2) + std::pow(z - 31, 2);
        return std::exp(-r / (2 * 4 * 4));
    });
    const auto lost = band_of(smooth);
    const double oblique = lost.over_difference({0.5, 0.6, 0.62}),
                 steep = lost.over_difference({0.06, 0, 1});
    // Its spectrum is 1e-12 of its top at 0.3 cycles, where an oblique plane meets a repetition;
    // what is told of it is the rounding of f32 and the window's side lobes of 92 dB.
    EXPECT_GE(oblique, 0);
    EXPECT_LT(oblique, 1e-3);
    EXPECT_GT(steep, oblique);  // the repetition's middle is near
}

TEST(LostBand, TheTrilinearFieldLosesMore) {
    std::mt19937 random(4);
    const Data noise =
        volume_of({40, 50, 33}, [&](auto...) { return static_cast<double>(random()) * 0x1p-32; });
    EXPECT_GT(band_of(noise, kernels::Between::linear).over_difference({1, 2, 3}),
              3 * band_of(noise).over_difference({1, 2, 3}));
}

TEST(LostBand, SaysNothingOfAConstant) {
    const Data constant = volume_of({40, 40, 40}, [](auto...) { return 7; });
    EXPECT_LT(band_of(constant).over_difference({0, 1, 2}), 0);
}

}  // namespace
}  // namespace edgewise
