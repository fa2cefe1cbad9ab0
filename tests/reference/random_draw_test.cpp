#include "reference/random_draw.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <numeric>
#include <set>

namespace edgewise {
namespace {

TEST(RandomOrder, HasEachNumberOnce) {
    for (const std::int64_t size : {1, 2, 3, 64, 1000}) {
        std::set<std::int64_t> seen;
        const RandomOrder order(size, 5);
        for (std::int64_t i = 0; i < size; ++i) seen.insert(order[i]);
        EXPECT_EQ(static_cast<std::int64_t>(seen.size()), size);
        EXPECT_EQ(*seen.begin(), 0);
        EXPECT_EQ(*seen.rbegin(), size - 1);
    }
}

/// The first ten of 100 numbers, of 2000 seeds: each number in a tenth of them, and as a neighbour
/// of another in a hundredth.
TEST(RandomOrder, IsEvenAndWithoutPattern) {
    std::vector<int> times(100, 0);
    int neighbours = 0;
    for (std::uint64_t seed = 0; seed < 2000; ++seed) {
        const RandomOrder order(100, seed);
        for (int i = 0; i < 10; ++i) ++times[static_cast<std::size_t>(order[i])];
        for (int i = 0; i < 9; ++i) neighbours += order[i + 1] == order[i] + 1;
    }
    // Of a binomial of 2000 and 0.1: 200, and 13 of standard deviation; of 100 none is 4.5 away.
    for (const int each : times) EXPECT_NEAR(each, 200, 60);
    EXPECT_NEAR(neighbours, 180, 60);
}

TEST(DrawByChance, KeepsEveryChanceAndTheNumber) {
    std::vector<double> chances;
    for (int i = 0; i < 60; ++i) chances.push_back(i % 7 == 0 ? 1 : 0.05 + 0.01 * (i % 50));
    const double expected = std::accumulate(chances.begin(), chances.end(), 0.0);
    std::vector<int> times(chances.size(), 0);
    constexpr int kSeeds = 4000;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
        const std::vector<std::size_t> drawn = draw_by_chance(chances, seed);
        EXPECT_LE(std::abs(static_cast<double>(drawn.size()) - expected), 1);
        EXPECT_EQ(std::set(drawn.begin(), drawn.end()).size(), drawn.size());
        for (const std::size_t place : drawn) ++times[place];
    }
    // 5 standard deviations of a binomial.
    for (std::size_t i = 0; i < chances.size(); ++i)
        EXPECT_NEAR(times[i], kSeeds * chances[i],
                    5 * std::sqrt(kSeeds * chances[i] * (1 - chances[i])) + 1e-9);
}

}  // namespace
}  // namespace edgewise
