#include "transitions/kernels/transfer_sums.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace edgewise::kernels {
namespace {

/// Optical depth per length, and the same times each colour, by the points as they are given.
std::array<double, 4> rates(const std::vector<OpticsPoint>& points, double unit, double value) {
    OpticsPoint at = value < points.front().value ? points.front() : points.back();
    for (std::size_t i = 1; i < points.size(); ++i) {
        const OpticsPoint &a = points[i - 1], &b = points[i];
        if (value < a.value || value >= b.value) continue;
        const double f = (value - a.value) / (b.value - a.value);
        at.opacity = a.opacity + f * (b.opacity - a.opacity);
        for (std::size_t c = 0; c < 3; ++c)
            at.color[c] = a.color[c] + f * (b.color[c] - a.color[c]);
    }
    const double depth = -std::log1p(-at.opacity) / unit;
    return {depth, depth * at.color[0], depth * at.color[1], depth * at.color[2]};
}

/// What the table has between two numbers, as kernels read it: integers, then what lies beyond.
std::array<double, 4> between(const TransferSums& sums, double from, double to) {
    const auto reached = [&](double number, std::size_t c) {
        const double at =
            (number - static_cast<double>(sums.first)) * static_cast<double>(sums.per_number);
        const auto cell = static_cast<std::size_t>(std::clamp(at, 0.0, TransferSums::kCells - 1.0));
        return double(sums.knots[cell][c]) +
               (at - static_cast<double>(cell)) * double(sums.slopes[cell][c]);
    };
    std::array<double, 4> all;
    for (std::size_t c = 0; c < 4; ++c)
        all[c] = (reached(to, c) - reached(from, c)) * static_cast<double>(sums.scale);
    return all;
}

struct Function {
    std::string name;
    std::vector<OpticsPoint> points;
    double unit, slope, jump;  // the largest of its depth per length
};

const std::vector<Function> kFunctions = {
    {"gentle", {{0, 0, {1, 0.5, 0}}, {40, 0.5, {0, 0.5, 1}}}, 0.7, 0.025 / 0.7, 0},
    {"jump",
     {{10, 0, {1, 0.5, 0}}, {12, 0.6, {1, 0.5, 0}}, {12, 0.1, {0, 0, 1}}, {40, 0.9, {0.2, 1, 1}}},
     2,
     0.75 / 2,
     (std::log1p(-0.1) - std::log1p(-0.6)) / 2},
    // Faint beyond what is nearly opaque: of f32 sums nothing would be left there.
    {"faint", {{0, 0.9999, {1, 1, 1}}, {1, 1e-3, {0, 0, 1}}, {100, 2e-3, {1, 0, 0}}}, 1, 1e4, 0},
    // Knots of f32 are 64 apart there.
    {"far off", {{1e9, 0, {1, 1, 1}}, {1e9 + 2048, 0.5, {0, 1, 1}}}, 1, 1e-3 / 2, 0},
};

/// The error that the header states, against sums of small pieces in f64.
TEST(TransferSums, ErrByWhatTheySay) {
    for (const Function& function : kFunctions) {
        const std::vector<OpticsPoint>& points = function.points;
        const TransferSums sums = transfer_sums_of(optics_of(points, function.unit, {}));
        ASSERT_EQ(sums.knots.size(), std::size_t{TransferSums::kCells});
        const double low = points.front().value, range = points.back().value - low;
        const double width = sums.width,
                     whole = TransferSums::kOne * static_cast<double>(sums.scale);
        for (const auto& [a, b] : {std::pair{-0.5, 1.5},
                                   {0.1234, 0.7891},
                                   {0.3, 0.3006},
                                   {0.0491, 0.0703},
                                   {0.99, 3.0},
                                   {0.9, 0.902},
                                   {-3.0, -1.0}}) {
            const double from = low + a * range, to = low + b * range;
            std::array<double, 4> exact{};
            constexpr int kPieces = 200000;
            for (int i = 0; i < kPieces; ++i) {
                const double step = (to - from) / kPieces;
                const auto here = rates(points, function.unit, from + (i + 0.5) * step);
                for (std::size_t c = 0; c < 4; ++c) exact[c] += step * here[c];
            }
            // Of colours times depth slopes and jumps are larger by that of the colour. The sums of
            // pieces cut a jump, and the steep end of the faint one, by a part of a piece. Points,
            // slopes and the scale are f32.
            const double piece = (to - from) / kPieces;
            const double slope = 2 * function.slope + 10 / range;
            const double within = 2 * (slope * width * width / 8 + function.jump * width / 4) +
                                  (function.jump + function.slope * piece) * piece +
                                  whole * 0x1p-29 + exact[0] * 0x1p-22;
            const std::array<double, 4> made = between(sums, from, to);
            for (std::size_t c = 0; c < 4; ++c)
                EXPECT_NEAR(made[c], exact[c], within) << function.name << ' ' << a << ' ' << c;
        }
    }
}

/// Behind an opaque stretch, numbers two cells apart: what f32 sums lose there is 1 % of a unit.
TEST(TransferSums, KeepFaintDepthsBehindOpaqueOnes) {
    const std::vector<OpticsPoint> points = {
        {0, 1, {1, 1, 1}}, {50, 1, {1, 1, 1}}, {50, 1e-3, {1, 1, 1}}, {100, 1e-3, {1, 1, 1}}};
    const TransferSums sums = transfer_sums_of(optics_of(points, 1, {}));
    const double depth = -std::log1p(-1e-3), width = sums.width;
    for (double at = 51; at < 99; at += 0.377) {
        const double made = between(sums, at, at + 2 * width)[0] / (2 * width);
        // Half an integer at either end, of 2^30 that are 50 lengths of depth 100.
        EXPECT_NEAR(made, depth, 50 * 100 * 0x1p-30 / (2 * width)) << at;
    }
}

TEST(TransferSums, OfOneValueAndOfNothing) {
    const std::vector<OpticsPoint> one = {{3e8, 0.25, {0.5, 0.5, 0.5}}}, none = {{3, 0, {1, 1, 1}}};
    const TransferSums sums = transfer_sums_of(optics_of(one, 1, {}));
    const std::array<double, 4> made = between(sums, -1e9, 1e9);
    EXPECT_NEAR(made[0] / 2e9, -std::log(0.75), 1e-5);  // a step of the table is 1e-7 of the way
    EXPECT_NEAR(made[1] / 2e9, -0.5 * std::log(0.75), 1e-5);
    for (const double sum : between(transfer_sums_of(optics_of(none, 1, {})), -1e9, 1e9))
        EXPECT_EQ(sum, 0);
}

}  // namespace
}  // namespace edgewise::kernels
