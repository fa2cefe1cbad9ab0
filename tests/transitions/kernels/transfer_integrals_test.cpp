#include "transitions/kernels/transfer_integrals.hpp"

#include <cmath>
#include <gtest/gtest.h>

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
