#include "transitions/kernels/combine.hpp"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <vector>

namespace edgewise::kernels {
namespace {

constexpr Extent kExtent{37, 11, 70};
const std::vector<OpticsPoint> kPoints = {
    {-50, 0, {1, 0, 0}}, {0, 0.02, {0.2, 0.8, 0}}, {60, 0.2, {1, 1, 0.5}}};

std::vector<double> random_values(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> value(-100, 100);
    std::vector<double> values(kExtent.samples());
    for (double& v : values) v = std::round(value(random));
    return values;
}

template <class T>
std::vector<T> stored_as(const std::vector<double>& values) {
    std::vector<T> stored(values.size() + kSlack);
    for (std::size_t i = 0; i < values.size(); ++i) stored[i] = static_cast<T>(values[i]);
    return stored;
}

/// Spans that begin and end anywhere, some empty, some between two planes.
struct Spans {
    std::ptrdiff_t pitch = PixelStates::pitch_of(kExtent.x);
    std::vector<float> low, high;

    Spans() : low(pitch * kExtent.y + 16), high(low.size()) {
        std::mt19937 random(3);
        std::uniform_real_distribution<float> at(-0.5f, 69.5f);
        for (std::size_t i = 0; i < low.size(); ++i) {
            low[i] = i % 3 ? -0.5f : at(random);
            high[i] = i % 3 == 1 ? 69.5f : i % 7 ? at(random) : low[i] + 0.3f;
        }
    }
    PixelSpans view() const { return {low.data(), high.data(), pitch}; }
};

struct States {
    std::vector<float> floats;
    PixelStates view;

    explicit States(Combine rule) {
        view.pitch = PixelStates::pitch_of(kExtent.x);
        view.plane = view.pitch * kExtent.y;
        floats.resize(view.plane * PixelStates::planes(rule) + 16, -9);
        view.first = floats.data();
    }
};

std::vector<float> picture_of(const Combining& with, const Grid& volume, const Spans& spans,
                              std::vector<std::int64_t> cuts = {}) {
    States all(with.rule);
    clear_states(with, all.view, kExtent.x, kExtent.y);
    cuts.push_back(kExtent.z);
    std::int64_t begin = 0;
    for (const std::int64_t end : cuts) {
        States part(with.rule);
        clear_states(with, part.view, kExtent.x, kExtent.y);
        combine(with, volume, 0, 0, kExtent.x, kExtent.y, begin, end, spans.view(), part.view);
        merge_states(with, all.view, part.view, kExtent.x, kExtent.y);
        begin = end;
    }
    const int channels = with.rule == Combine::over ? 4 : 1;
    std::vector<float> out(kExtent.x * kExtent.y * channels);
    finish_states(with, all.view, kExtent.x, kExtent.y, out.data(), kExtent.x * channels);
    return out;
}

double transfer(double value, int channel) {  // channel 3: opacity
    const auto at = [&](const OpticsPoint& p) {
        return channel == 3 ? p.opacity : p.color[channel];
    };
    for (std::size_t i = 0; i < kPoints.size(); ++i) {
        if (value > kPoints[i].value) continue;
        if (i == 0) return at(kPoints[0]);
        const double f = (value - kPoints[i - 1].value) / (kPoints[i].value - kPoints[i - 1].value);
        return at(kPoints[i - 1]) + f * (at(kPoints[i]) - at(kPoints[i - 1]));
    }
    return at(kPoints.back());
}

/// One pixel in f64: for every plane inside the span, its share of the span.
std::array<double, 4> reference(const Combining& with, const std::vector<double>& values,
                                const Spans& spans, std::int64_t x, std::int64_t y, double unit) {
    const double low = spans.low[y * spans.pitch + x], high = spans.high[y * spans.pitch + x];
    double best = -1e300, sum = 0, length = 0, left = 1;
    std::array<double, 4> light{};
    for (std::int64_t z = 0; z < kExtent.z; ++z) {
        if (z < low || z > high) continue;
        const double begin = z - 1 < low ? low : z - 0.5, end = z + 1 > high ? high : z + 0.5;
        const double value = with.values(values[(z * kExtent.y + y) * kExtent.x + x]);
        if (!std::isfinite(value)) continue;
        best = std::max(best, value);
        sum += (end - begin) * value;
        length += end - begin;
        const double opacity =
            1 - std::pow(1 - transfer(value, 3), (end - begin) * with.step / unit);
        for (int c = 0; c < 3; ++c) light[c] += left * opacity * transfer(value, c);
        left *= 1 - opacity;
    }
    if (with.rule == Combine::max) return {length > 0 ? best : with.miss};
    if (with.rule == Combine::mean) return {length > 0 ? sum / length : with.miss};
    if (with.rule == Combine::sum) return {(sum - with.zero * length) * with.step * with.unit};
    light[3] = 1 - left;
    return light;
}

void expect_reference(Combining with, const Grid& volume, const std::vector<double>& values) {
    const double unit = 0.7;
    const Spans spans;
    const Optics optics = optics_of(kPoints, unit, volume.values);
    with.values = volume.values;
    with.optics = &optics;
    const auto out = picture_of(with, volume, spans);
    const int channels = with.rule == Combine::over ? 4 : 1;
    // Sums of 70 f32 numbers up to 250: blocks of 32, so 35 roundings of 250 x 70 x 6e-8.
    const double tolerance = with.rule == Combine::sum    ? 4e-2
                             : with.rule == Combine::over ? 1e-5
                                                          : 1e-3;
    double worst = 0;
    for (std::int64_t y = 0; y < kExtent.y; ++y)
        for (std::int64_t x = 0; x < kExtent.x; ++x) {
            const auto want = reference(with, values, spans, x, y, unit);
            for (int c = 0; c < channels; ++c)
                worst =
                    std::max(worst, std::abs(out[(y * kExtent.x + x) * channels + c] - want[c]));
        }
    EXPECT_LE(worst, tolerance) << "rule " << static_cast<int>(with.rule) << " type "
                                << name_of(volume.type);
}

const Combine kRules[] = {Combine::max, Combine::sum, Combine::mean, Combine::over};

TEST(Combine, EveryTypeEqualsTheReference) {
    const auto values = random_values(1);
    auto positive = values;
    for (double& v : positive) v = std::abs(v);
    const auto i8 = stored_as<std::int8_t>(values);
    const auto i16 = stored_as<std::int16_t>(values);
    const auto f32 = stored_as<float>(values);
    const auto f64 = stored_as<double>(values);
    const auto u8 = stored_as<std::uint8_t>(positive);
    const auto u16 = stored_as<std::uint16_t>(positive);
    for (const Combine rule : kRules) {
        const Combining with{.rule = rule, .step = 1.3, .unit = 0.5, .zero = -3, .miss = -7};
        expect_reference(with, {i8.data(), Type::i8, kExtent, 1, {0.5, 3}}, values);
        expect_reference(with, {i16.data(), Type::i16, kExtent, 1, {-2.5, 3}}, values);
        expect_reference(with, {f32.data(), Type::f32, kExtent, 1, {}}, values);
        expect_reference(with, {f64.data(), Type::f64, kExtent, 1, {}}, values);
        expect_reference(with, {u8.data(), Type::u8, kExtent, 1, {}}, positive);
        expect_reference(with, {u16.data(), Type::u16, kExtent, 1, {}}, positive);
    }
}

TEST(Combine, NotFiniteSamplesDoNotCount) {
    auto values = random_values(2);
    for (std::size_t i = 0; i < values.size(); i += 5)
        values[i] = i % 2 ? std::numeric_limits<double>::quiet_NaN()
                          : std::numeric_limits<double>::infinity();
    const auto f32 = stored_as<float>(values);
    for (const Combine rule : kRules)
        expect_reference({.rule = rule}, {f32.data(), Type::f32, kExtent, 1, {}}, values);
}

TEST(Combine, PartsMergeToTheWhole) {
    const auto values = random_values(4);
    const auto i16 = stored_as<std::int16_t>(values);
    const Grid volume{i16.data(), Type::i16, kExtent, 1, {}};
    const Optics optics = optics_of(kPoints, 1, {});
    const Spans spans;
    for (const Combine rule : kRules) {
        const Combining with{.rule = rule, .optics = &optics};
        const auto whole = picture_of(with, volume, spans);
        const auto parts = picture_of(with, volume, spans, {1, 7, 32, 40, 69});
        // Over in another association: S29. Sums: 35 roundings of at most 70 x 100 x 6e-8.
        const double tolerance = rule == Combine::max ? 0 : rule == Combine::over ? 2e-6 : 1.5e-2;
        for (std::size_t i = 0; i < whole.size(); ++i) ASSERT_NEAR(whole[i], parts[i], tolerance);
    }
}

TEST(Combine, NeighboursAndTilesDoNotMatter) {
    const auto values = random_values(5);
    const auto f32 = stored_as<float>(values);
    const Grid volume{f32.data(), Type::f32, kExtent, 1, {}};
    const Optics optics = optics_of(kPoints, 1, {});
    const Spans spans;
    for (const Combine rule : kRules) {
        const Combining with{.rule = rule, .optics = &optics};
        const int channels = rule == Combine::over ? 4 : 1;
        const auto whole = picture_of(with, volume, spans);
        for (std::int64_t y = 0; y < kExtent.y; y += 3)
            for (std::int64_t x = 0; x < kExtent.x; x += 5) {
                const std::int64_t w = std::min<std::int64_t>(5, kExtent.x - x);
                const std::int64_t h = std::min<std::int64_t>(3, kExtent.y - y);
                States tile(rule);
                clear_states(with, tile.view, w, h);
                const PixelSpans here{spans.low.data() + y * spans.pitch + x,
                                      spans.high.data() + y * spans.pitch + x, spans.pitch};
                combine(with, volume, x, y, w, h, 0, kExtent.z, here, tile.view);
                std::vector<float> out(w * h * channels);
                finish_states(with, tile.view, w, h, out.data(), w * channels);
                for (std::int64_t r = 0; r < h; ++r)
                    ASSERT_EQ(0, std::memcmp(out.data() + r * w * channels,
                                             whole.data() + ((y + r) * kExtent.x + x) * channels,
                                             w * channels * sizeof(float)));
            }
    }
}

}  // namespace
}  // namespace edgewise::kernels
