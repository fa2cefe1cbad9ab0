#include "transitions/kernels/spline_prefilter.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <tbb/global_control.h>
#include <vector>

namespace edgewise::kernels {
namespace {

std::int64_t mirror(std::int64_t i, std::int64_t n) {
    while (n > 1 && (i < 0 || i >= n)) i = i < 0 ? -i : 2 * (n - 1) - i;
    return n == 1 ? 0 : i;
}

std::vector<float> noise(const Extent& extent, int channels = 1) {
    std::mt19937 random(17);
    std::uniform_real_distribution<float> draw(0, 1);
    std::vector<float> samples(std::size_t(extent.samples() * channels));
    for (float& sample : samples) sample = draw(random);
    return samples;
}

/// The spline at the samples: (1, 4, 1) / 6 along each axis, mirrored, in f64.
std::vector<double> spline_at_samples(const std::vector<float>& coefficients, const Extent& n,
                                      int channels) {
    std::vector<double> from(coefficients.begin(), coefficients.end()), to(from.size());
    for (int axis = 0; axis < 3; ++axis) {
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x)
                    for (int c = 0; c < channels; ++c) {
                        const auto at = [&](int step) {
                            std::array<std::int64_t, 3> p{x, y, z};
                            p[axis] = mirror(p[axis] + step, n[axis]);
                            return std::size_t(((p[2] * n.y + p[1]) * n.x + p[0]) * channels + c);
                        };
                        to[at(0)] = (from[at(-1)] + 4 * from[at(0)] + from[at(1)]) / 6;
                    }
        std::swap(from, to);
    }
    return from;
}

TEST(SplinePrefilter, SplineRunsThroughTheSamples) {
    for (const Extent& n : {Extent{2, 1, 1},
                            {3, 1, 1},
                            {1, 40, 1},
                            {100, 1, 1},
                            {7, 130, 1},
                            {64, 64, 1},
                            {2, 2, 2},
                            {50, 1, 3},
                            {31, 33, 35},
                            {130, 20, 9}})
        for (int channels : {1, 3}) {
            const std::vector<float> samples = noise(n, channels);
            std::vector<float> coefficients = samples;
            spline_prefilter(coefficients.data(), n, channels);
            const std::vector<double> back = spline_at_samples(coefficients, n, channels);
            for (std::size_t i = 0; i < samples.size(); ++i)
                // Coefficients of noise reach 3 an axis; f32 rounds each recursion by 2^-24 of
                // that.
                ASSERT_NEAR(back[i], samples[i], 3e-6) << n.x << "x" << n.y << "x" << n.z;
        }
}

TEST(SplinePrefilter, ImpulseGivesPowersOfThePole) {
    const double pole = std::sqrt(3.0) - 2;
    std::vector<float> line(101, 0.0f);
    line[50] = 1;
    spline_prefilter(line.data(), {101, 1, 1});
    for (int k = -50; k <= 50; ++k)  // sqrt(3) pole^|k|; borders, 50 samples off, add 1e-28
        EXPECT_NEAR(line[std::size_t(50 + k)], std::sqrt(3.0) * std::pow(pole, std::abs(k)), 2e-7);
}

TEST(SplinePrefilter, ConstantStaysConstant) {
    const Extent n{37, 21, 5};
    std::vector<float> samples(std::size_t(n.samples()), 3.0f);
    spline_prefilter(samples.data(), n);
    for (float sample : samples) ASSERT_NEAR(sample, 3, 3e-6);  // eight roundings of 2^-24 * 3
}

TEST(SplinePrefilter, SameBytesForAnyThreads) {
    const Extent n{150, 70, 33};
    std::vector<std::vector<float>> results;
    for (std::size_t threads : {1, 2, 7}) {
        tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        results.push_back(noise(n));
        spline_prefilter(results.back().data(), n);
        EXPECT_EQ(results.back(), results.front());
    }
}

TEST(SplinePrefilter, EmptyAndSingleSamplesAreLeftAlone) {
    spline_prefilter(nullptr, {0, 4, 4});
    float one = 5;
    spline_prefilter(&one, {1, 1, 1});
    EXPECT_EQ(one, 5);
}

}  // namespace
}  // namespace edgewise::kernels
