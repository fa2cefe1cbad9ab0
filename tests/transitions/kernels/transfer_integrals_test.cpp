#include "transitions/kernels/transfer_integrals.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace edgewise::kernels {
namespace {

const std::vector<OpticsPoint> kPoints = {
    {10, 0, {1, 0.5, 0}}, {12, 0.6, {1, 0.5, 0}}, {12, 0.1, {0, 0, 1}}, {40, 0.9, {0.2, 1, 1}}};

/// Up to a number, as kernels read it.
std::array<double, 4> reached(const TransferIntegrals& integrals, double number) {
    const double at =
        (number - static_cast<double>(integrals.first)) * static_cast<double>(integrals.per_number);
    const auto cell =
        static_cast<std::size_t>(std::clamp(at, 0.0, TransferIntegrals::kCells - 1.0));
    std::array<double, 4> sums;
    for (std::size_t c = 0; c < 4; ++c) {
        const double a = integrals.knots[cell][c], b = integrals.knots[cell + 1][c];
        sums[c] = a + (at - static_cast<double>(cell)) * (b - a);
    }
    return sums;
}

TEST(TransferIntegrals, AreSumsOfSmallPieces) {
    for (const ValueMap& values : {ValueMap{}, ValueMap{-0.5, 30}}) {
        const Optics optics = optics_of(kPoints, 0.7, values);
        const TransferIntegrals integrals = transfer_integrals_of(optics);
        ASSERT_EQ(integrals.knots.size(), TransferIntegrals::kCells + 1U);
        for (const auto& [from, to] :
             {std::pair{-5.0, 8.0}, {11.0, 13.0}, {0.0, 60.0}, {39.0, 41.0}}) {
            std::array<double, 4> exact{};
            constexpr int kPieces = 400000;
            for (int i = 0; i < kPieces; ++i) {
                const double width = (to - from) / kPieces;
                const std::array<double, 4> here = optics_at(optics, from + (i + 0.5) * width);
                exact[0] += width * here[0];
                for (std::size_t c = 1; c < 4; ++c) exact[c] += width * here[0] * here[c];
            }
            const std::array<double, 4> a = reached(integrals, from), b = reached(integrals, to);
            // The width of a cell at the jump, and f32.
            const double within = 3 * static_cast<double>(integrals.width) + 60 * 0x1p-20;
            for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(b[c] - a[c], exact[c], within) << c;
        }
    }
}

/// The same in f32, as kernels work it out.
std::array<float, 4> reached_by_kernels(const TransferIntegrals& integrals, float number) {
    const float at = (number - integrals.first) * integrals.per_number;
    const auto cell = static_cast<std::size_t>(
        std::min(std::max(at, 0.0f), static_cast<float>(TransferIntegrals::kCells - 1)));
    const float share = at - static_cast<float>(cell);
    std::array<float, 4> sums;
    for (std::size_t c = 0; c < 4; ++c) {
        const float a = integrals.knots[cell][c], b = integrals.knots[cell + 1][c];
        sums[c] = a + share * (b - a);
    }
    return sums;
}

/// One of the four functions and what it does over a stretch.
struct Stretch {
    double integral = 0, variation = 0;
};
Stretch stretch(const Optics& optics, std::size_t c, double from, double to) {
    constexpr int kPieces = 6000;
    const auto value = [&](double at) {
        const std::array<double, 4> all = optics_at(optics, at);
        return c == 0 ? all[0] : all[0] * all[c];
    };
    const double width = (to - from) / kPieces;
    Stretch over;
    double before = value(from);
    for (int i = 0; i < kPieces; ++i) {
        over.integral += width * value(from + (i + 0.5) * width);
        const double here = value(from + (i + 1) * width);
        over.variation += std::abs(here - before);
        before = here;
    }
    return over;
}

TEST(TransferIntegrals, ErrByNoMoreThanIsStated) {
    const std::vector<OpticsPoint> smooth = {
        {10, 0, {1, 0.5, 0}}, {25, 0.5, {0, 0.5, 1}}, {40, 0.1, {0.2, 1, 1}}};
    std::mt19937 random(3);
    double largest = 0;  // of what is allowed
    for (const auto& points : {kPoints, smooth}) {
        const Optics optics = optics_of(points, 0.7, ValueMap{});
        const TransferIntegrals integrals = transfer_integrals_of(optics);
        const double w = integrals.width, first = integrals.first;
        double most = 0;
        for (double at = 0; at < 50; at += 0.001) most = std::max(most, optics_at(optics, at)[0]);
        std::uniform_real_distribution<double> anywhere(5, 45), cells(2, 9);
        for (int i = 0; i < 400; ++i) {
            const auto a =
                static_cast<float>(i % 3 ? anywhere(random) : 12 + 2 * w * (0.5 - i % 7));
            const auto b = static_cast<float>(i % 2 ? anywhere(random)
                                                    : static_cast<double>(a) + w * cells(random));
            const double from = std::min(a, b), to = std::max(a, b);
            if (to - from < 2 * w) continue;
            const auto low = reached_by_kernels(integrals, static_cast<float>(from)),
                       high = reached_by_kernels(integrals, static_cast<float>(to));
            const auto cell_of = [&](double number) {
                return first + w * std::floor((number - first) / w);
            };
            const double farthest = std::max(std::abs(from - first), std::abs(to - first)) / w;
            const double rounding = 4 * TransferIntegrals::kCells * 0x1p-24 + 0x1p-22 * farthest;
            for (std::size_t c = 0; c < 4; ++c) {
                // Cells a little wider than they are: rounding may take the next one.
                const auto variation = [&](double number) {
                    return stretch(optics, c, cell_of(number) - 0.01 * w,
                                   cell_of(number) + 1.01 * w)
                        .variation;
                };
                const Stretch exact = stretch(optics, c, from, to);
                const double apart = to - from;
                const double allowed = w / apart *
                                           ((variation(from) + variation(to)) / 4 +
                                            exact.variation / 16 + rounding * most) +
                                       (to > 40 ? 0x1p-11 * most : 0);
                const double mean = static_cast<double>(high[c] - low[c]) / apart;
                // The exact integral's own sum of pieces, at its one jump.
                const double by_sum = exact.variation / 6000;
                ASSERT_LE(std::abs(mean - exact.integral / apart), allowed + by_sum)
                    << from << ' ' << to << ' ' << c;
                largest =
                    std::max(largest, std::abs(mean - exact.integral / apart) / (allowed + by_sum));
            }
        }
    }
    EXPECT_GT(largest, 0.2) << "the bound says something";
}

TEST(TransferIntegrals, OfAConstantFunctionGoOnEvenly) {
    const std::vector<OpticsPoint> one = {{3, 0.25, {0.5, 0.5, 0.5}}};
    const Optics optics = optics_of(one, 1, {});
    const TransferIntegrals integrals = transfer_integrals_of(optics);
    const std::array<double, 4> a = reached(integrals, -100), b = reached(integrals, 100);
    EXPECT_NEAR(b[0] - a[0], -200 * std::log(0.75), 1e-2);
    EXPECT_NEAR(b[1] - a[1], -100 * std::log(0.75), 1e-2);
}

}  // namespace
}  // namespace edgewise::kernels
