// What every filter promises, swept over all there are.
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "graph/errors.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/tap_polynomials.hpp"

namespace edgewise {
namespace {

using Weights = std::array<double, kernels::TapPolynomials::kMostTaps>;

Weights weights_at(const Filter& filter, double f) {
    Weights weights{};
    filter.weights(f, weights.data());
    return weights;
}

/// Where tap k lies, from the sample before the place.
int place_of(const Filter& filter, int tap) { return tap + 1 - filter.taps / 2; }

TEST(Filters, WeightsAddUpToOne) {
    for (const Filter& filter : filters())
        for (int i = 0; i < 64; ++i) {
            double sum = 0;
            for (const double weight : weights_at(filter, i / 64.0)) sum += weight;
            EXPECT_NEAR(sum, 1, 1e-14) << filter.name;
        }
}

TEST(Filters, ThoseThatReadSamplesGiveTheSampleItself) {
    for (const Filter& filter : filters()) {
        if (filter.coefficients) continue;
        const Weights weights = weights_at(filter, 0);
        for (int tap = 0; tap < filter.taps; ++tap)
            EXPECT_NEAR(weights[tap], place_of(filter, tap) == 0 || filter.taps == 1, 1e-15)
                << filter.name;
    }
}

/// f^k comes out for k < order: of coefficients the spline's own polynomials need a prefilter, so
/// these are left out.
TEST(Filters, PolynomialsBelowTheOrderComeOutExactly) {
    for (const Filter& filter : filters()) {
        if (filter.coefficients || filter.taps == 1) continue;
        for (int i = 0; i < 32; ++i) {
            const double f = i / 32.0;
            const Weights weights = weights_at(filter, f);
            for (int power = 0; power < filter.order; ++power) {
                double sum = 0;
                for (int tap = 0; tap < filter.taps; ++tap)
                    sum += weights[tap] * std::pow(place_of(filter, tap), power);
                EXPECT_NEAR(sum, std::pow(f, power), 1e-13) << filter.name << power;
            }
        }
    }
}

TEST(Filters, SignsOfWeightsAreAsToldOnBothSides) {
    for (const Filter& filter : filters()) {
        double least = 1;
        for (int i = 0; i < 64; ++i)
            for (int tap = 0; tap < filter.taps; ++tap)
                least = std::min(least, weights_at(filter, i / 64.0)[tap]);
        EXPECT_EQ(least >= 0, filter.positive) << filter.name;
    }
}

/// The mean over all places of the sum of squared weights; of coefficients with their making, which
/// the test of the prefilter knows.
TEST(Filters, NoiseGainsAreThoseOfTheWeights) {
    for (const Filter& filter : filters()) {
        if (filter.coefficients) continue;
        constexpr int kPlaces = 4096;
        double squares = 0;
        for (int i = 0; i < kPlaces; ++i)
            for (const double weight : weights_at(filter, (i + 0.5) / kPlaces))
                squares += weight * weight / kPlaces;
        EXPECT_NEAR(std::sqrt(squares), filter.noise_gain, 2e-3) << filter.name;
    }
}

/// The response is the transform of the kernel that the weights are samples of.
TEST(Filters, ResponsesAreTransformsOfTheWeights) {
    for (const Filter& filter : filters()) {
        EXPECT_NEAR(filter.response(0), 1, 5e-3) << filter.name;
        if (filter.coefficients || filter.taps == 1) continue;
        for (const double frequency : {0.1, 0.25, 0.45, 0.8, 1.3}) {
            constexpr int kPlaces = 2048;
            double sum = 0;
            for (int i = 0; i < kPlaces; ++i) {
                const double f = (i + 0.5) / kPlaces;
                for (int tap = 0; tap < filter.taps; ++tap)
                    sum += weights_at(filter, f)[tap] / kPlaces *
                           std::cos(2 * std::numbers::pi * frequency * (f - place_of(filter, tap)));
            }
            EXPECT_NEAR(filter.response(frequency), sum, 1e-2) << filter.name << frequency;
        }
    }
}

TEST(Filters, PolynomialsOfTapsAreTheWeights) {
    for (const Filter& filter : filters()) {
        const kernels::TapPolynomials& polynomials = kernels::TapPolynomials::of(filter);
        EXPECT_EQ(polynomials.taps(), filter.taps);
        for (int i = 0; i < 333; ++i) {
            const double f = i / 333.0;
            const Weights weights = weights_at(filter, f);
            for (int tap = 0; tap < filter.taps; ++tap) {
                float value = 0;
                for (int power = polynomials.degree(); power >= 0; --power)
                    value = value * static_cast<float>(f) + polynomials.coefficient(tap, power);
                // A product and a sum a degree, each rounded by 2^-24 of some 1; coefficients of a
                // steep polynomial are larger than its values.
                EXPECT_NEAR(value, weights[tap], 4e-6) << filter.name << " " << f;
            }
        }
    }
    EXPECT_EQ(kernels::TapPolynomials::of(filter_named("keys")).degree(), 3);
}

TEST(Filters, AnUnknownNameIsAnErrorThatListsThoseThereAre) {
    try {
        filter_named("nearest");
        FAIL();
    } catch (const RequestError& error) {
        EXPECT_NE(std::string(error.what()).find("zoh, foh, bspline3, keys, lanczos3"),
                  std::string::npos)
            << error.what();
    }
}

}  // namespace
}  // namespace edgewise
