#include "reference/drawn_pixels.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <set>

namespace edgewise {
namespace {

/// Mostly smooth, with a few places that carry nearly all.
std::vector<double> heavy_tailed(std::size_t count) {
    std::vector<double> rough(count);
    for (std::size_t i = 0; i < count; ++i) rough[i] = i % 50 == 7 ? 100 + double(i % 13) : 0.1;
    return rough;
}

TEST(DrawInProportion, EstimatesAMeanThatFewPlacesCarry) {
    const std::vector<double> rough = heavy_tailed(4000);
    double mean = 0;
    for (const double value : rough) mean += value / double(rough.size());
    double sum = 0, weights = 0;
    const std::vector<RoughDraw> drawn = draw_in_proportion(rough, 300);
    for (const auto& [place, chance, weight] : drawn) {
        sum += weight * rough[place];
        weights += weight;
    }
    EXPECT_NEAR(double(drawn.size()), 300, 1);
    EXPECT_NEAR(weights / double(drawn.size()), 1, 0.05);
    EXPECT_NEAR(sum / double(drawn.size()), mean, 0.02 * mean);
}

TEST(DrawInProportion, TakesNoPlaceTwiceAndWhatIsRoughestSurely) {
    std::vector<double> rough(1000, 1.0);
    rough[123] = 1e6;
    std::set<std::size_t> places;
    for (const auto& [place, chance, weight] : draw_in_proportion(rough, 100)) {
        EXPECT_TRUE(places.insert(place).second);
        if (place == 123) {  // it stands for itself alone
            EXPECT_NEAR(weight, 0.1, 1e-9);
        }
    }
    EXPECT_TRUE(places.contains(123));
}

/// Horvitz and Thompson's estimate of how many there are.
TEST(DrawInProportion, TellsHowLikelyEachWasDrawn) {
    const std::vector<double> rough = heavy_tailed(4000);
    double count = 0;
    for (const auto& [place, chance, weight] : draw_in_proportion(rough, 300)) {
        EXPECT_GT(chance, 0);
        EXPECT_LE(chance, 1);
        EXPECT_NEAR(weight * chance, 300.0 / 4000, 1e-12);
        count += 1 / chance;
    }
    EXPECT_NEAR(count, 4000, 0.05 * 4000);
}

TEST(DrawInProportion, IsEvenWhereNothingIsRough) {
    for (const auto& [place, chance, weight] :
         draw_in_proportion(std::vector<double>(500, 0.0), 50))
        EXPECT_NEAR(weight, 1, 1e-9);
}

}  // namespace
}  // namespace edgewise
