#include "transitions/kernels/scale.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "transitions/filters/filter.hpp"

namespace edgewise::kernels {
namespace {

constexpr Extent kFrom{11, 7, 9}, kTo{23, 7, 14};
constexpr std::array<double, 3> kSteps{11 / 22.7, 1, 0.66};

std::vector<double> random_values() {
    std::mt19937 random(5);
    std::vector<double> values(kFrom.samples());
    for (double& value : values) value = static_cast<double>(random() % 200);
    return values;
}

template <class T>
std::vector<T> stored_as(const std::vector<double>& values) {
    std::vector<T> stored(values.begin(), values.end());
    stored.resize(values.size() + kSlack);
    return stored;
}

std::array<ScaledAxis, 3> axes_by(const Filter& filter) {
    std::array<ScaledAxis, 3> axes;
    for (int axis = 0; axis < 3; ++axis)
        axes[axis] = scaled_axis(kFrom[axis], kTo[axis], kSteps[axis], filter);
    return axes;
}

/// A value at a place of the grid in f64, all taps of the filter at once.
double expected(const std::vector<double>& values, const Filter& filter,
                const std::array<std::int64_t, 3>& at) {
    struct Tap {
        std::int64_t sample;
        double weight;
    };
    std::array<std::vector<Tap>, 3> taps;
    for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t n = kFrom[axis];
        double p = (at[axis] - (kTo[axis] - 1) / 2.0) * kSteps[axis] + (n - 1) / 2.0;
        p = std::clamp(p, 0.0, n - 1.0);
        if (filter.taps == 1) {
            taps[axis] = {{static_cast<std::int64_t>(std::floor(p + 0.5)), 1}};
            continue;
        }
        const double cell = std::floor(p);
        std::vector<double> weights(filter.taps);
        filter.weights(p - cell, weights.data());
        for (int tap = 0; tap < filter.taps; ++tap) {
            std::int64_t i = static_cast<std::int64_t>(cell) + 1 - filter.taps / 2 + tap;
            if (filter.coefficients) {
                if (i < 0) i = -i;
                if (i > n - 1) i = 2 * (n - 1) - i;
            }
            taps[axis].push_back({std::clamp<std::int64_t>(i, 0, n - 1), weights[tap]});
        }
    }
    double sum = 0;
    for (const Tap& z : taps[2])
        for (const Tap& y : taps[1])
            for (const Tap& x : taps[0])
                sum += x.weight * y.weight * z.weight *
                       values[(z.sample * kFrom.y + y.sample) * kFrom.x + x.sample];
    return sum;
}

std::vector<float> scaled(const Scaling& by, const Region& box) {
    const Extent n = box.extent();
    std::vector<float> out(n.samples(), -9), scratch(by.scratch_floats(box));
    by(box, out.data(), n.x, n.x * n.y, scratch.data());
    return out;
}

template <class T>
void expect_reference(Type type, const Filter& filter) {
    const std::vector<double> values = random_values();
    const std::vector<T> stored = stored_as<T>(values);
    const Grid grid{stored.data(), type, kFrom, 1, {0.5, -30}};
    const std::vector<float> got = scaled(Scaling(grid, axes_by(filter)), Region::all(kTo));
    double worst = 0;
    for (std::int64_t i = 0; i < kTo.samples(); ++i) {
        const double want =
            expected(values, filter, {i % kTo.x, i / kTo.x % kTo.y, i / kTo.x / kTo.y});
        worst = std::max(worst, std::abs(got[i] - (0.5 * want - 30)));
    }
    // f32 rounds the weights and sums along three axes of numbers up to 200, by 2^-24 of them each:
    // some 20 roundings, halved by the slope; Lanczos weights add up to 1.2 an axis in size.
    EXPECT_LE(worst, 20 * 200 * 0x1p-24) << filter.name << " " << name_of(type);
}

TEST(Scaling, IsTheSeparableSumOfTheFilterForEveryType) {
    for (const Filter& filter : filters()) {
        expect_reference<std::uint8_t>(Type::u8, filter);
        expect_reference<std::int16_t>(Type::i16, filter);
        expect_reference<std::int32_t>(Type::i32, filter);
        expect_reference<float>(Type::f32, filter);
        expect_reference<double>(Type::f64, filter);
    }
}

TEST(Scaling, HalvesAreReadAsTheNumbersTheyStandFor) {
    std::vector<std::uint16_t> halves(kFrom.samples() + kSlack, 0x3e00);  // 1.5
    const Grid grid{halves.data(), Type::f16, kFrom, 1, {}};
    for (const float value : scaled(Scaling(grid, axes_by(filter_named("foh"))), Region::all(kTo)))
        EXPECT_NEAR(value, 1.5, 1e-6);
}

TEST(Scaling, AnAxisThatKeepsItsSamplesIsCopied) {
    const ScaledAxis kept = scaled_axis(7, 7, 1, filter_named("lanczos3"));
    EXPECT_EQ(kept.taps, 1);
    EXPECT_EQ(kept.sample, (std::vector<std::int64_t>{0, 1, 2, 3, 4, 5, 6}));
    // Coefficients are no samples: a spline is read even where these lie.
    EXPECT_EQ(scaled_axis(7, 7, 1, filter_named("bspline3")).taps, 4);
}

TEST(Scaling, BoxesAreThoseOfTheWholeByteForByteAndReadNoOtherSample) {
    for (const Filter& filter : filters()) {
        std::vector<float> stored = stored_as<float>(random_values());
        const Grid grid{stored.data(), Type::f32, kFrom, 1, {}};
        const Scaling by(grid, axes_by(filter));
        const std::vector<float> whole = scaled(by, Region::all(kTo));
        const Region box{{5, 2, 3}, {17, 6, 9}};
        const Region read = by.reads(box);
        for (std::int64_t i = 0; i < kFrom.samples(); ++i) {
            const std::array<std::int64_t, 3> at{i % kFrom.x, i / kFrom.x % kFrom.y,
                                                 i / kFrom.x / kFrom.y};
            for (int axis = 0; axis < 3; ++axis)
                if (at[axis] < read.begin[axis] || at[axis] >= read.end[axis])
                    stored[i] = std::nanf("");
        }
        const std::vector<float> part = scaled(by, box);
        const Extent n = box.extent();
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                ASSERT_EQ(0, std::memcmp(part.data() + (z * n.y + y) * n.x,
                                         whole.data() + ((z + 3) * kTo.y + y + 2) * kTo.x + 5,
                                         n.x * sizeof(float)))
                    << filter.name;
    }
}

}  // namespace
}  // namespace edgewise::kernels
