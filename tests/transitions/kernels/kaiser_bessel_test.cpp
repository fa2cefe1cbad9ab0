#include "transitions/kernels/kaiser_bessel.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <vector>

namespace edgewise::kernels {
namespace {

constexpr double kPi = std::numbers::pi;

/// A window's transform but for a factor, worked out here: b = 0 is the triangle's.
double faded(int width, double b, double x) {
    if (b == 0) return x == 0 ? 1 : std::pow(std::sin(kPi * x) / (kPi * x), 2);
    const double turn = kPi * width * x, square = b * b - turn * turn;
    const double root = std::sqrt(std::abs(square));
    return root < 1e-9 ? 1 : (square > 0 ? std::sinh(root) : std::sin(root)) / root;
}

/// Root mean square over the field of the summed squares of the ghosts.
double mean_ghost(int width, double padding, double b) {
    constexpr int kPlaces = 400;
    double squares = 0;
    for (int i = 0; i <= kPlaces; ++i) {
        const double x = i * 0.5 / padding / kPlaces;
        double ghosts = 0;
        for (int m = 1; m <= 8; ++m)
            ghosts += std::pow(faded(width, b, x + m), 2) + std::pow(faded(width, b, x - m), 2);
        squares += ghosts / std::pow(faded(width, b, x), 2);
    }
    return std::sqrt(squares / (kPlaces + 1));
}

TEST(KaiserBessel, EveryWidthHasThreePaddings) {
    EXPECT_EQ(known_windows().size(), 22u);
    for (int width = 2; width <= 8; ++width)
        for (const double padding : {1.25, 1.5, 2.})
            EXPECT_TRUE(KaiserBessel::known(width, padding)) << width << " " << padding;
    EXPECT_TRUE(KaiserBessel::known(2, 1));
    for (const auto& [width, padding] :
         {std::pair{1, 2.}, {9, 2.}, {4, 1.}, {3, 1.}, {4, 1.3}, {4, 4.}, {0, 0.}, {-1, 2.}})
        EXPECT_FALSE(KaiserBessel::known(width, padding)) << width << " " << padding;
}

TEST(KaiserBessel, ShapesLeaveTheLeastMeanGhost) {
    for (const KaiserBessel& window : known_windows()) {
        const int width = window.width();
        SCOPED_TRACE(testing::Message() << width << " " << window.padding());
        const double ghost = mean_ghost(width, window.padding(), window.shape());
        // Constants of three digits.
        EXPECT_NEAR(window.mean_ghost() / ghost, 1, 0.02);
        if (width == 2 && window.padding() == 1) continue;  // a triangle has no shape
        for (double per_tap = 1.2; per_tap < 2.8; per_tap += 0.02)
            EXPECT_LT(ghost, 1.02 * mean_ghost(width, window.padding(), per_tap * width));
    }
}

TEST(KaiserBessel, BoundsHoldTheGhostsOfEverySample) {
    constexpr int kPlaces = 150;
    for (const KaiserBessel& window : known_windows()) {
        SCOPED_TRACE(testing::Message() << window.width() << " " << window.padding());
        double largest = 0;
        for (int i = 0; i <= kPlaces; ++i) {
            const double x = i * 0.5 / window.padding() / kPlaces;
            double sum = 0;
            for (int m = 1; m <= 256; ++m)
                sum += std::abs(faded(window.width(), window.shape(), x + m)) +
                       std::abs(faded(window.width(), window.shape(), x - m));
            largest = std::max(largest, sum / faded(window.width(), window.shape(), x));
            EXPECT_LE(window.ghost(x), window.bound());
        }
        EXPECT_LT(largest, 1.005 * window.bound());  // a constant of three digits
        EXPECT_GT(largest, 0.9 * window.bound());
    }
}

TEST(KaiserBessel, AmplifiesRoundingAsItSays) {
    constexpr int kPlaces = 400, kSteps = 4000;
    for (const KaiserBessel& window : known_windows()) {
        double energy = 0, squares = 0;
        for (int i = 0; i < kSteps; ++i)
            energy += std::pow(window(((i + 0.5) / kSteps - 0.5) * window.width()), 2) *
                      window.width() / kSteps;
        for (int i = 0; i <= kPlaces; ++i)
            squares += energy / std::pow(window.transform(i * 0.5 / window.padding() / kPlaces), 2);
        EXPECT_NEAR(window.amplified() / std::sqrt(squares / (kPlaces + 1)), 1, 0.02)
            << window.width() << " " << window.padding();
    }
}

TEST(KaiserBessel, TransformsAreIntegrals) {
    constexpr int kSteps = 20000;
    for (const KaiserBessel& window : known_windows())
        for (const double x : {0., 0.1, 0.33, 0.9, 2.2}) {
            double sum = 0;
            for (int i = 0; i < kSteps; ++i) {
                const double t = ((i + 0.5) / kSteps - 0.5) * window.width();
                sum += window(t) * std::cos(2 * kPi * t * x) * window.width() / kSteps;
            }
            // Midpoints; a window of two taps ends with a step of 1 / 5.
            EXPECT_NEAR(window.transform(x), sum, 2e-6) << window.width() << " " << x;
        }
}

TEST(KaiserBessel, MoreTapsAndMorePaddingLeaveLess) {
    for (const double padding : {1.25, 1.5, 2.})
        for (int width = 3; width <= 8; ++width) {
            const KaiserBessel window(width, padding), narrower(width - 1, padding);
            EXPECT_LT(window.bound(), narrower.bound());
            EXPECT_LT(window.mean_ghost(), narrower.mean_ghost());
            if (padding < 2) {
                EXPECT_LT(KaiserBessel(width, 2).bound(), window.bound());
            }
        }
}

/// Interpolating linearly between rows of the table leaves an eighth of its curvature, at most
/// 4 b / width^2 of the top, over the square of the rows.
TEST(TapTable, EveryTableHoldsItsWindow) {
    for (const KaiserBessel& window : known_windows()) {
        const TapTable& table = TapTable::of(window);
        const int width = window.width(), rows = table.fractions;
        ASSERT_EQ(table.width, width);
        const double bend = 4 * window.shape() / (width * width);
        const double most = bend / 8 / (1. * rows * rows) + 1.2e-7;
        for (int row = 0; row < 2 * rows; ++row)
            for (int tap = 0; tap < TapTable::kMostTaps; ++tap) {
                const float* low = &table.taps[(row / 2) * TapTable::kMostTaps + tap];
                const double got =
                    row % 2 ? (double(low[0]) + low[TapTable::kMostTaps]) / 2 : low[0];
                // Of an even width the place is past sample 0, else half a sample earlier.
                const double place = row / 2. / rows - (width % 2 ? 0.5 : 0);
                const int sample = tap - (width - 1) / 2;
                ASSERT_NEAR(got, tap < width ? window(place - sample) : 0, most)
                    << width << " " << row << " " << tap;
                ASSERT_EQ(table.pairs[2 * (row / 2 * TapTable::kMostTaps + tap)], low[0]);
            }
    }
}

}  // namespace
}  // namespace edgewise::kernels
