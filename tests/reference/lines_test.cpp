// Integrals along lines and votes as the reference has them, beside sums that are known; and what
// a Verifier finds of results that are wrong.
#include "reference/lines.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

#include "reference/verify.hpp"

namespace edgewise {
namespace {

using To = RadonSetting::To;

std::pmr::memory_resource* heap() { return std::pmr::get_default_resource(); }

/// A request with its samples.
struct LineCase {
    Request want;
    Data in;

    LineCase(const Extent& extent, const RadonSetting& setting,
             std::array<double, 2> spacing = {1, 1}) {
        Representation what;
        what.extent = extent;
        what.axes = extent.z == 1 ? 2 : 3;
        in = Data::make(what, heap());
        want.job = radon_job();
        want.axes = what.axes;
        want.input = extent;
        want.spacing = {spacing[0], spacing[1], 1};
        want.setting = JobSetting::of(setting);
        want.field = Field::linear;
        want.views = Placement(Mat4::Identity());
        want.screen = lines().extent();
        std::mt19937 random(5);
        for (std::int64_t i = 0; i < extent.samples(); ++i)
            in.as<float>()[i] = static_cast<float>(random() % 200) - 50;
    }
    RadonLines lines() const {
        return {want.input,
                {want.spacing[0], want.spacing[1]},
                want.setting.as<RadonSetting>()->angles};
    }
    double at(std::int64_t x, std::int64_t y, std::int64_t z) const {
        const Extent& n = want.input;
        const bool inside = x >= 0 && y >= 0 && x < n.x && y < n.y;
        return inside ? double(*in.at<float>(x, y, z)) : 0;
    }
    std::vector<OutputSample> all() const {
        std::vector<OutputSample> samples;
        for (std::int64_t z = 0; z < want.screen.z; ++z)
            for (std::int64_t y = 0; y < want.screen.y; ++y)
                for (std::int64_t x = 0; x < want.screen.x; ++x) samples.push_back({0, x, y, z});
        return samples;
    }
    /// What the reference has, as an edge would deliver it.
    Data right() const {
        const ReferenceField field(in, Field::linear);
        const std::vector<double> values = Reference(want, field, heap()).values(all());
        Representation what;
        what.extent = want.screen;
        what.axes = want.axes;
        Data out = Data::make(what, heap());
        std::copy(values.begin(), values.end(), out.as<float>());
        return out;
    }
    Verified verified(const Data& result, std::int64_t samples) const {
        const ReferenceField field(in, Field::linear);
        Verifier verifier(want, field, samples, 3, heap());
        verifier.frame(0, result);
        return verifier.finish();
    }
};

TEST(LineReference, AlongTheAxesIntegralsAreSumsOfSamples) {
    const LineCase of({7, 5, 2}, {.angles = 2}, {0.5, 2});
    const RadonLines lines = of.lines();
    const Data out = of.right();
    for (std::int64_t z = 0; z < 2; ++z) {
        // Columns lie 0.5 apart, as offsets do; along one of them samples are 2 apart.
        for (std::int64_t x = 0; x < 7; ++x) {
            double sum = 0;
            for (std::int64_t y = 0; y < 5; ++y) sum += 2 * of.at(x, y, z);
            EXPECT_NEAR(*out.at<float>(lines.middle() + x - 3, 0, z), sum, 1e-4);
        }
        // Rows lie four offsets apart, y down.
        for (std::int64_t y = 0; y < 5; ++y) {
            double sum = 0;
            for (std::int64_t x = 0; x < 7; ++x) sum += 0.5 * of.at(x, y, z);
            EXPECT_NEAR(*out.at<float>(lines.middle() - 4 * (y - 2), 1, z), sum, 1e-4);
        }
    }
}

TEST(LineReference, IntegralsAreThoseOfManyShortSteps) {
    const LineCase of({13, 9, 1}, {.angles = 7}, {1, 1.3});
    const RadonLines lines = of.lines();
    const Data out = of.right();
    constexpr int kSteps = 20'000;
    for (int k = 0; k < 7; ++k)
        for (std::int64_t m = 0; m < lines.offsets; m += 3) {
            const double c = std::cos(M_PI * k / 7), s = std::sin(M_PI * k / 7);
            const double r = double(m - lines.middle()) * lines.step;
            double sum = 0;
            for (int i = 0; i < kSteps; ++i) {
                const double t = lines.diagonal * ((i + 0.5) / kSteps - 0.5);
                const double x = 6 + r * c + t * s, y = 4 + (-r * s + t * c) / 1.3;
                const double left = std::floor(x), top = std::floor(y), u = x - left, v = y - top;
                const auto i0 = std::int64_t(left), j0 = std::int64_t(top);
                sum += (1 - v) * ((1 - u) * of.at(i0, j0, 0) + u * of.at(i0 + 1, j0, 0)) +
                       v * ((1 - u) * of.at(i0, j0 + 1, 0) + u * of.at(i0 + 1, j0 + 1, 0));
            }
            // Midpoints are off by the square of a step where the slope jumps by 200, 40 times.
            const double step = lines.diagonal / kSteps;
            EXPECT_NEAR(*out.at<float>(m, k, 0), sum * step, 40 * 200 * step * step + 1e-4);
        }
}

TEST(LineReference, EachSampleVotesOnceAnAngleForTheNearestLine) {
    const LineCase of({11, 8, 1}, {.angles = 12, .to = To::hough, .threshold = 20});
    const RadonLines lines = of.lines();
    const Data out = of.right();
    for (int k = 0; k < 12; ++k) {
        const double c = std::cos(M_PI * k / 12), s = std::sin(M_PI * k / 12);
        std::vector<double> sure(std::size_t(lines.offsets), 0), more = sure;
        for (std::int64_t y = 0; y < 8; ++y)
            for (std::int64_t x = 0; x < 11; ++x) {
                if (of.at(x, y, 0) < 20) continue;
                const double r = (double(x) - 5) * c - (double(y) - 3.5) * s;
                // Halfway between two lines rounding of c and s decides.
                const auto low = std::int64_t(std::floor(r + 0.5 - 1e-12)) + lines.middle();
                const auto high = std::int64_t(std::floor(r + 0.5 + 1e-12)) + lines.middle();
                sure[std::size_t(low)] += low == high;
                more[std::size_t(low)] += low != high, more[std::size_t(high)] += low != high;
            }
        for (std::int64_t m = 0; m < lines.offsets; ++m) {
            const double votes = *out.at<float>(m, k, 0);
            EXPECT_GE(votes, sure[std::size_t(m)]);
            EXPECT_LE(votes, sure[std::size_t(m)] + more[std::size_t(m)]);
        }
    }
}

TEST(LineReference, WhatIsNotFiniteIsLeftOut) {
    LineCase of({9, 9, 1}, {.angles = 4});
    *of.in.at<float>(4, 4, 0) = std::numeric_limits<float>::quiet_NaN();
    const Data out = of.right();
    for (int k = 0; k < 4; ++k) EXPECT_TRUE(std::isnan(*out.at<float>(of.lines().middle(), k, 0)));
    EXPECT_TRUE(std::isfinite(*out.at<float>(of.lines().middle() + 3, 0, 0)));
    const Verified verified = of.verified(out, 0);
    EXPECT_LT(verified.samples, of.want.screen.samples());
    EXPECT_LT(verified.nrmse, 1e-7);
}

TEST(Verifier, ErrorsOfSinogramsCountByRangeTimesDiagonal) {
    const LineCase of({40, 30, 1}, {.angles = 24});
    Data result = of.right();
    const Verified right = of.verified(result, 0);
    EXPECT_EQ(right.samples, of.want.screen.samples());
    EXPECT_LT(right.nrmse, 1e-7);
    const auto [low, high] = std::minmax_element(of.in.as<float>(), of.in.as<float>() + 40 * 30);
    EXPECT_NEAR(right.range, double(*high - *low) * of.lines().diagonal, 1e-6 * right.range);
    // Each result is off by a hundredth of that: so is their mean.
    for (std::int64_t i = 0; i < of.want.screen.samples(); ++i)
        result.as<float>()[i] += static_cast<float>(0.01 * right.range);
    EXPECT_NEAR(of.verified(result, 0).nrmse, 0.01, 1e-6);
    const Verified drawn = of.verified(result, 64);
    EXPECT_NEAR(drawn.nrmse, 0.01, 1e-6);
    EXPECT_LT(drawn.samples, right.samples);
}

TEST(Verifier, FindsOneLineThatIsWrongAndOneVote) {
    for (const To to : {To::sinogram, To::hough}) {
        const LineCase of({40, 30, 1}, {.angles = 24, .to = to, .threshold = 60});
        Data result = of.right();
        EXPECT_LT(of.verified(result, 0).nrmse, 1e-7);
        const std::int64_t place = of.lines().offsets * 11 + of.lines().middle();
        result.as<float>()[place] += 1;
        const Verified wrong = of.verified(result, 0);
        EXPECT_GT(wrong.nrmse, 0);
        EXPECT_NEAR(wrong.max, 1, 1e-3);
        result.as<float>()[place] = std::numeric_limits<float>::quiet_NaN();
        EXPECT_TRUE(std::isinf(of.verified(result, 0).nrmse));
    }
}

TEST(Verifier, RefusesLinesThatWouldTakeHours) {
    LineCase of({4, 4, 1}, {.angles = 65536, .to = To::hough, .threshold = 0});
    of.want.input = {60'000, 60'000, 1};
    const ReferenceField field(of.in, Field::linear);
    const Reference reference(of.want, field, heap());
    EXPECT_THROW(reference.expect_affordable(1e9), std::exception);
    EXPECT_NO_THROW(reference.expect_affordable(10));
}

}  // namespace
}  // namespace edgewise
