#include "transitions/kernels/visible_runs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <memory_resource>
#include <random>
#include <vector>

#include "transitions/kernels/shear_warp_runs.hpp"

namespace edgewise::kernels {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();
using Points = std::vector<OpticsPoint>;

const std::vector<Points> kTransfers = {
    {{20, 0, {1, 0, 0}}, {200, 0.3, {0.2, 0.8, 0.5}}},
    {{40, 0, {1, 1, 1}}, {60, 0.5, {1, 1, 1}}, {80, 0, {1, 1, 1}}},
    {{10, 0.1, {1, 1, 0}}, {30, 0, {1, 1, 0}}, {60, 0, {0, 1, 1}}, {60, 0.7, {0, 1, 1}}},
    {{50, 0, {1, 1, 1}}, {50, 1, {1, 1, 1}}},  // a jump
    {{0, 1, {1, 1, 1}}, {0, 0, {1, 1, 1}}},    // at 0, downwards
    {{30, 0, {1, 1, 1}}, {120, 0, {1, 1, 1}}},
    {{30, 0.25, {1, 1, 1}}},
};

double opacity_at(const Points& points, double value) {
    if (value <= points.front().value) return points.front().opacity;
    for (std::size_t i = 1; i < points.size(); ++i)
        if (value <= points[i].value) {
            const double width = points[i].value - points[i - 1].value;
            const double f = width > 0 ? (value - points[i - 1].value) / width : 1;
            return points[i - 1].opacity + f * (points[i].opacity - points[i - 1].opacity);
        }
    return points.back().opacity;
}

/// As kernels look opacities up, with and without fused operations.
float looked_up(const Optics& optics, float value, bool fused) {
    float opacity = optics.opacity;
    for (const OpticsRamp& ramp : optics.ramps) {
        const float part = std::clamp((value - ramp.start) * ramp.inverse_width, 0.0f, 1.0f);
        opacity = fused ? std::fma(part, ramp.opacity, opacity) : opacity + part * ramp.opacity;
    }
    return std::max(opacity, 0.0f);
}

bool holds(const std::vector<UnseenSpan>& spans, double value) {
    return std::any_of(spans.begin(), spans.end(), [value](const UnseenSpan& span) {
        return value >= double(span.low) && value <= double(span.high);
    });
}

TEST(UnseenSpans, HaveNoOpacityToTheBitAndNothingElseHasNone) {
    std::mt19937 random(5);
    std::vector<Points> all = kTransfers;
    for (int i = 0; i < 60; ++i) {  // odd numbers, of which some are transparent
        Points points;
        std::uniform_real_distribution<double> at(-300, 300), share(0, 1);
        for (int p = 0; p < 6; ++p)
            points.push_back({at(random), share(random) < 0.5 ? 0 : share(random), {1, 1, 1}});
        std::sort(points.begin(), points.end(),
                  [](const auto& a, const auto& b) { return a.value < b.value; });
        all.push_back(points);
    }
    for (const Points& points : all)
        for (const ValueMap& values : {ValueMap{}, ValueMap{-0.5, 17}, ValueMap{3, -1000}}) {
            const Optics optics = optics_of(points, 1, values);
            const std::vector<UnseenSpan> spans = unseen_of(optics);
            const auto expect_none = [&](float value) {
                for (const bool fused : {false, true})
                    EXPECT_EQ(looked_up(optics, value, fused), 0) << value;
            };
            for (const UnseenSpan& span : spans) {
                EXPECT_LE(span.low, span.high);
                const float low = std::max(span.low, -1e4f), high = std::min(span.high, 1e4f);
                for (const float end : {low, high}) {
                    expect_none(end);
                    expect_none(std::clamp(std::nextafter(end, kInf), low, high));
                    expect_none(std::clamp(std::nextafter(end, -kInf), low, high));
                }
                for (int i = 0; i < 50; ++i)
                    expect_none(std::uniform_real_distribution<float>(low, high)(random));
            }
            // Where the function is 0 around a value, it is in a span; but what is left of the sum
            // of opacities that do not cancel in f32 counts.
            for (double stored = -2000; stored < 2000; stored += 0.37) {
                const double near = 1e-3;
                bool none = true, some = true;
                for (const double by : {-near, 0.0, near}) {
                    const double opacity = opacity_at(points, values(stored + by));
                    none = none && opacity == 0;
                    some = some && opacity > 1e-6;
                }
                const auto value = static_cast<float>(stored);
                if (none && looked_up(optics, value, true) == 0) {
                    EXPECT_TRUE(holds(spans, value)) << value;
                }
                if (some) {
                    EXPECT_FALSE(holds(spans, value)) << value;
                }
            }
        }
}

template <class T>
std::vector<T> blobs(const Extent& n, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<T> samples(n.samples() + kSlack);
    for (std::int64_t z = 0; z < n.z; ++z)
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                // Empty but for some rows of random values, and steps from side to side.
                const bool some = (x / 13 + y / 5 + z) % 3 == 0, step = x > 2 * n.x / 3;
                const int value = some ? static_cast<int>(random() % 120) : step ? 100 : 0;
                samples[(z * n.y + y) * n.x + x] = static_cast<T>(value);
            }
    return samples;
}

double sample(const Grid& g, std::int64_t x, std::int64_t y, std::int64_t z) {
    const std::int64_t n =
        (z * g.extent.y + std::min(y, g.extent.y - 1)) * g.extent.x + std::min(x, g.extent.x - 1);
    switch (g.type) {
        case Type::u8:
            return g.as<std::uint8_t>()[n];
        case Type::i8:
            return g.as<std::int8_t>()[n];
        case Type::u16:
            return g.as<std::uint16_t>()[n];
        case Type::i16:
            return g.as<std::int16_t>()[n];
        case Type::f64:
            return g.as<double>()[n];
        default:
            return double(g.as<float>()[n]);
    }
}

void expect_runs(const Grid& grid) {
    auto* memory = std::pmr::new_delete_resource();
    for (const Points& points : kTransfers) {
        const std::vector<UnseenSpan> unseen = unseen_of(optics_of(points, 1, grid.values));
        VisibleRuns runs(grid.extent, memory);
        const Extent& n = grid.extent;
        double bytes = 0;
        for (std::int64_t z = 0; z < n.z; ++z) {
            runs.slices[z] = visible_slice(grid, unseen, z, memory);
            bytes +=
                double(runs.slices[z].numbers.bytes() + kArraySlack + sizeof(VisibleRuns::Slice));
        }
        EXPECT_LE(bytes, VisibleRuns::bytes(n));
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y) {
                std::vector<char> in_run(n.x), seen(n.x), alike(n.x);
                std::int64_t before = -100;
                for (const VisibleRuns::Run& run : runs.row(y, z)) {
                    ASSERT_LT(run.begin, run.end);
                    ASSERT_LE(run.end, n.x);
                    ASSERT_GT(run.begin - before, VisibleRuns::kGap);
                    before = run.end;
                    std::fill(in_run.begin() + run.begin, in_run.begin() + run.end, 1);
                    EXPECT_GE(y, runs.slices[z].first);
                    EXPECT_LT(y, runs.slices[z].last);
                }
                for (std::int64_t x = 0; x < n.x; ++x) {
                    const double a = sample(grid, x, y, z), b = sample(grid, x + 1, y, z);
                    const double c = sample(grid, x, y + 1, z), d = sample(grid, x + 1, y + 1, z);
                    bool finite = true;
                    for (int v = 0; v <= 8; ++v)
                        for (int u = 0; u <= 8; ++u) {
                            const double f = u / 8., g = v / 8.;
                            const double value = (1 - g) * (a + (f > 0 ? f * (b - a) : 0)) +
                                                 (g > 0 ? g * (c + (f > 0 ? f * (d - c) : 0)) : 0);
                            finite = finite && std::isfinite(value);
                            seen[x] = seen[x] || (std::isfinite(value) &&
                                                  opacity_at(points, grid.values(value)) > 1e-9);
                        }
                    if (seen[x]) {
                        EXPECT_TRUE(in_run[x]) << x << ' ' << y << ' ' << z;
                    }
                    // Of cells inside one span nothing is held, but near others that are.
                    const double low = std::min({a, b, c, d}), high = std::max({a, b, c, d});
                    alike[x] =
                        finite && std::any_of(unseen.begin(), unseen.end(), [&](auto span) {
                            return low > double(span.low) + 0.5 && high < double(span.high) - 0.5;
                        });
                }
                // The ends of runs are cells that are seen.
                for (const VisibleRuns::Run& run : runs.row(y, z)) {
                    EXPECT_FALSE(alike[run.begin]) << run.begin << ' ' << y << ' ' << z;
                    EXPECT_FALSE(alike[run.end - 1]) << run.end << ' ' << y << ' ' << z;
                }
            }
    }
}

TEST(VisibleRuns, HoldEveryCellInWhichAPlaceIsSeen) {
    for (const Extent& n :
         {Extent{83, 21, 3}, Extent{1, 5, 2}, Extent{130, 1, 1}, Extent{7, 7, 1}}) {
        const auto u8 = blobs<std::uint8_t>(n, 1);
        const auto i8 = blobs<std::int8_t>(n, 2);
        const auto u16 = blobs<std::uint16_t>(n, 3);
        const auto i16 = blobs<std::int16_t>(n, 4);
        auto f32 = blobs<float>(n, 5);
        const auto f64 = blobs<double>(n, 6);
        f32[n.samples() / 2] = std::numeric_limits<float>::quiet_NaN();
        f32[n.samples() / 3] = kInf;
        const Grid grids[] = {
            {u8.data(), Type::u8, n, 1, {}},          {i8.data(), Type::i8, n, 1, {2, -1}},
            {u16.data(), Type::u16, n, 1, {-1, 120}}, {i16.data(), Type::i16, n, 1, {}},
            {f32.data(), Type::f32, n, 1, {0.5, 20}}, {f64.data(), Type::f64, n, 1, {}}};
        for (const Grid& grid : grids) expect_runs(grid);
    }
}

TEST(VisibleRuns, OfNothingAreNone) {
    const Extent n{40, 6, 1};
    const std::vector<std::uint8_t> samples(n.samples() + kSlack, 9);
    const Grid grid{samples.data(), Type::u8, n, 1, {}};
    const auto unseen = unseen_of(optics_of(kTransfers[0], 1, {}));
    const auto slice = visible_slice(grid, unseen, 0, std::pmr::new_delete_resource());
    EXPECT_EQ(slice.runs, 0);
    EXPECT_EQ(slice.last, 0);
    const auto all = visible_slice(grid, {}, 0, std::pmr::new_delete_resource());
    EXPECT_EQ(all.runs, 6);
    EXPECT_EQ(all.cells, n.samples());
}

// ---- the kernel against f64 --------------------------------------------------------------------

struct Tile {
    std::int64_t i, j, width, height;
};

/// One pixel, slice by slice in f64. Which slices a ray meets is decided in f32, as the spans are.
std::array<double, 4> reference(const ShearWarp& w, const Points& points, std::int64_t i,
                                std::int64_t j) {
    float low_f, high_f;
    shear_spans(w, i, j, 1, 1, &low_f, &high_f, 16);
    double low = double(low_f), high = double(high_f);
    const Extent& n = w.volume.extent;
    if (low < high && std::ceil(low) > high) {  // between two slices
        const double length = high - low, before = std::floor(low), after = before + 1;
        const double down = low - before, up = after - high;
        const bool first =
            after >= double(n.z) || (before >= 0 && (w.backwards ? down < up : down <= up));
        low = first ? before : after - length;
        high = first ? before + length : after;
    }
    std::array<double, 4> light{};
    double left = 1;
    for (std::int64_t s = 0; s < n.z; ++s) {
        const std::int64_t k = w.backwards ? n.z - 1 - s : s;
        if (double(k) < low || double(k) > high) continue;
        const double begin = double(k) - 1 < low ? low : double(k) - 0.5;
        const double end = double(k) + 1 > high ? high : double(k) + 0.5;
        const double x = std::clamp(double(i) + w.x + double(k) * w.dx, 0.0, double(n.x - 1));
        const double y = std::clamp(double(j) + w.y + double(k) * w.dy, 0.0, double(n.y - 1));
        double value;
        if (w.hold == Hold::zoh) {
            value = sample(w.volume, std::int64_t(std::floor(x + 0.5)),
                           std::int64_t(std::floor(y + 0.5)), k);
        } else {
            const auto a = std::int64_t(std::floor(x)), b = std::int64_t(std::floor(y));
            const double f = x - double(a), g = y - double(b);
            value = (1 - g) *
                        ((1 - f) * sample(w.volume, a, b, k) + f * sample(w.volume, a + 1, b, k)) +
                    g * ((1 - f) * sample(w.volume, a, b + 1, k) +
                         f * sample(w.volume, a + 1, b + 1, k));
        }
        value = w.volume.values(value);
        if (!std::isfinite(value)) continue;
        const double opacity =
            1 - std::pow(1 - opacity_at(points, value), (end - begin) * w.with.step);
        light[0] += left * opacity;
        left *= 1 - opacity;
        if (left < w.with.bound) left = 0;
    }
    light[3] = 1 - left;
    return light;
}

std::vector<float> picture_of(const ShearWarp& warp, const VisibleRuns& runs, const Tile& tile) {
    constexpr std::ptrdiff_t kPitch = kRunsWidth, kPlane = kRunsWidth * kRunsHeight + 16;
    std::vector<float> low(kPlane), high(kPlane), floats(4 * kPlane);
    std::vector<float> out(tile.width * tile.height * 4);
    const PixelStates states{floats.data(), kPitch, kPlane};
    for (std::int64_t top = 0; top < tile.height; top += kRunsHeight)
        for (std::int64_t first = 0; first < tile.width; first += kRunsWidth) {
            const std::int64_t width = std::min(kRunsWidth, tile.width - first);
            const std::int64_t height = std::min(kRunsHeight, tile.height - top);
            shear_spans(warp, tile.i + first, tile.j + top, width, height, low.data(), high.data(),
                        kPitch);
            clear_states(warp.with, states, kRunsWidth, height);
            shear_warp_runs(warp, runs, tile.i + first, tile.j + top, width, height,
                            {low.data(), high.data(), kPitch}, states);
            finish_states(warp.with, states, width, height,
                          out.data() + (top * tile.width + first) * 4, tile.width * 4);
        }
    return out;
}

TEST(ShearWarpRuns, EqualsCompositesInF64) {
    const Extent n{53, 23, 34};
    const auto u8 = blobs<std::uint8_t>(n, 1);
    const auto i16 = blobs<std::int16_t>(n, 4);
    const auto f32 = blobs<float>(n, 5);
    const auto f64 = blobs<double>(n, 6);
    auto* memory = std::pmr::new_delete_resource();
    // A jump makes a whole opacity of the rounding of a value.
    const std::vector<Points> transfers = {
        kTransfers[0], kTransfers[1], kTransfers[6], {{60, 0, {1, 1, 1}}, {90, 1, {1, 1, 1}}}};
    const Tile tile{-25, -18, 150, 55};
    const Grid grids[] = {{u8.data(), Type::u8, n, 1, {}},
                          {i16.data(), Type::i16, n, 1, {-2, 240}},
                          {f32.data(), Type::f32, n, 1, {}},
                          {f64.data(), Type::f64, n, 1, {}}};
    for (const Grid& grid : grids)
        for (Points points : transfers) {
            for (OpticsPoint& point : points) point.color = {1, 1, 1};
            const Optics optics = optics_of(points, 1, grid.values);
            VisibleRuns runs(n, memory);
            for (std::int64_t z = 0; z < n.z; ++z)
                runs.slices[z] = visible_slice(grid, unseen_of(optics), z, memory);
            for (const Hold hold : {Hold::zoh, Hold::foh})
                for (const double bound : {0.0, 1.0 / 4096}) {
                    ShearWarp warp{.volume = grid,
                                   .hold = hold,
                                   .with = {.rule = Combine::over, .step = 1.21, .bound = bound}};
                    warp.with.values = grid.values;
                    warp.with.optics = &optics;
                    warp.backwards = bound > 0;
                    warp.x = -3.3, warp.dx = 0.37, warp.y = 4.71, warp.dy = -0.53;
                    const std::vector<float> out = picture_of(warp, runs, tile);
                    double worst = 0;
                    for (std::int64_t j = 0; j < tile.height; ++j)
                        for (std::int64_t i = 0; i < tile.width; ++i) {
                            const auto want = reference(warp, points, tile.i + i, tile.j + j);
                            const float* got = out.data() + (j * tile.width + i) * 4;
                            for (const int c : {0, 3})
                                worst = std::max(worst, std::abs(double(got[c]) - want[c]));
                        }
                    // f32 on steep ramps; where the bound is met in one of both, it is all that is
                    // left.
                    EXPECT_LE(worst, 1e-4 + bound) << name_of(grid.type) << " bound " << bound;
                }
        }
}

}  // namespace
}  // namespace edgewise::kernels
