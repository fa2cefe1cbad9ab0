#include "reference/error_tally.hpp"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace edgewise {
namespace {

constexpr int kTrials = 400;

/// Squares with heavy tails, and guesses of them that are mostly right.
struct Population {
    std::vector<double> square, guess;
    double mean = 0;

    Population() {
        std::mt19937_64 random(7);
        std::normal_distribution<double> normal;
        for (int i = 0; i < 50'000; ++i) {
            guess.push_back(std::exp(1.2 * normal(random)));
            square.push_back(1.3 * guess.back() * std::exp(0.25 * normal(random)));
            mean += square.back() / 50'000;
        }
    }
};

/// What estimates of many draws have come to, over the mean that they are of.
struct Trials {
    double mean = 0, spread = 0, error = 0, covered = 0;  // error: as estimated, RMS

    void add(const MeanSquare& estimate, double truth) {
        const double off = estimate.mean / truth - 1;
        mean += estimate.mean / truth / kTrials;
        spread += off * off / kTrials;
        error += estimate.variance / (truth * truth) / kTrials;
        covered += off + ErrorTally::kStandardErrors * std::sqrt(estimate.variance) / truth >= 0;
    }
};

/// Draws of both phases at random, the second from the first.
/// @param use  of the guesses: each unit's own, or another's
template <class Use>
std::array<Trials, 2> estimate(const Population& of, Use&& use) {
    std::mt19937_64 random(11);
    std::array<Trials, 2> trials;  // plain, regressed
    for (int trial = 0; trial < kTrials; ++trial) {
        std::vector<double> looked;
        ErrorTally tally;
        for (int i = 0; i < 4000; ++i) {
            const std::size_t unit = random() % of.square.size();
            looked.push_back(use(unit));
            if (i >= 100) continue;
            tally.add(of.square[unit], 1, looked.back());
            tally.close();
        }
        trials[0].add(tally.plain(), of.mean);
        trials[1].add(tally.regressed(Auxiliary::over(looked, HUGE_VAL)), of.mean);
    }
    return trials;
}

TEST(ErrorTally, IsBetterWithAGoodGuessAndStillRight) {
    const Population of;
    const auto [plain, regressed] = estimate(of, [&](std::size_t unit) { return of.guess[unit]; });
    EXPECT_LT(regressed.spread, 0.3 * plain.spread);
    // Three standard errors of the mean of trials, and what a slope of 100 units is off by.
    EXPECT_NEAR(regressed.mean, 1, 3 * std::sqrt(regressed.spread / kTrials) + 0.02);
    // What it says of itself is true, or more.
    EXPECT_GT(regressed.error, 0.9 * regressed.spread);
    EXPECT_GE(regressed.covered, 0.98 * kTrials);
}

TEST(ErrorTally, IsNotWorseWithAUselessGuess) {
    const Population of;
    const auto [plain, regressed] =
        estimate(of, [&](std::size_t unit) { return of.guess[unit * 7919 % 50'000]; });
    EXPECT_LT(regressed.spread, 1.1 * plain.spread);
    EXPECT_NEAR(regressed.mean, 1, 0.03);
}

TEST(ErrorTally, IsExactWhereEveryUnitWasLookedAtAndTheGuessIsProportional) {
    ErrorTally tally;
    std::vector<double> looked;
    for (int i = 0; i < 1000; ++i) {
        looked.push_back(i * i);
        if (i % 10 != 3) continue;
        tally.add(2.5 * i * i, 1 + i % 7, looked.back());
        tally.close();
    }
    const Auxiliary known = Auxiliary::over(looked, 1000);
    EXPECT_EQ(known.variance, 0);
    const MeanSquare mean = tally.regressed(known);
    EXPECT_NEAR(mean.mean, 2.5 * known.mean, 1e-9 * mean.mean);
    EXPECT_LT(std::sqrt(mean.variance), 1e-9 * mean.mean);
}

TEST(ErrorTally, IgnoresAGuessThatIsAlwaysTheSame) {
    ErrorTally tally;
    for (double square : {1.0, 2.0, 6.0, 3.0}) {
        tally.add(square, 1, 5);
        tally.close();
    }
    const MeanSquare mean = tally.regressed({.mean = 5, .variance = 0});
    EXPECT_EQ(mean.mean, 3);
    EXPECT_NEAR(mean.variance, 14.0 / 3 / 4, 1e-12);  // of four units, s^2 = 14/3
}

TEST(EstimateOf, TakesStrataByTheirShares) {
    ErrorTally whole, drawn;
    for (double square : {4.0, 4.0}) {
        whole.add(square, 1);
        whole.close();
    }
    for (double square : {1.0, 3.0}) {
        drawn.add(square, 1);
        drawn.close();
    }
    const std::array strata{Stratum{.share = 0.25, .tally = whole, .whole = true},
                            Stratum{.share = 0.75, .tally = drawn}};
    const ErrorEstimate error = estimate_of(strata);
    EXPECT_NEAR(error.likely, std::sqrt(2.5), 1e-12);
    EXPECT_NEAR(error.upper, std::sqrt(2.5 + 3 * 0.75), 1e-12);  // of 1 and 3: an error of 1
}

/// All of the large ones and every hundredth of the rest: what is left open is the rest's.
TEST(ErrorTally, LeavesNothingToChanceThatWasSureToBeDrawn) {
    ErrorTally tally;
    const auto draw = [&](double square, double chance) {
        tally.add(square, 1 / chance);
        tally.close(chance);
    };
    for (int i = 0; i < 10; ++i) draw(100 + i, 1);
    const double before = tally.plain().variance;
    EXPECT_EQ(before, 0);
    for (int i = 0; i < 40; ++i) draw(i % 2, 0.01);
    // Of 4010 units: 10 large ones, and 4000 of which each is 0 or 1.
    const MeanSquare estimate = tally.plain();
    EXPECT_NEAR(estimate.mean, (1045 + 2000) / 4010.0, 1e-12);
    // A share of 4000 from 40: 100 times the root of 40 times the variance about the mean, 0.25 and
    // what the mean of all is off theirs.
    const double off = estimate.mean - 0.5;
    EXPECT_NEAR(std::sqrt(estimate.variance) * 4010, 100 * std::sqrt(40 * (0.25 + off * off)),
                0.02 * 4010);
}

}  // namespace
}  // namespace edgewise
