// Which contenders of a pilot are worth another run.
#include "engine/contender.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace edgewise::cli {
namespace {

Contender path(double predicted, std::vector<double> seconds) {
    Contender path;
    path.plan.predicted.seconds = predicted;
    path.plan.predicted.spread = 0.1;
    path.seconds = std::move(seconds);
    return path;
}

TEST(Contender, TheFirstRunsSayNothingAgainstTheModels) {
    const Contender best = path(3e-3, {3e-3, 3e-3, 3e-3});
    // A processor slept for up to 20 ms.
    EXPECT_TRUE(path(1e-3, {18e-3}).is_close_to(best));
    EXPECT_TRUE(path(1e-3, {18e-3, 17e-3}).is_close_to(best));
    EXPECT_FALSE(path(1e-3, {18e-3, 17e-3, 18e-3}).is_close_to(best));
    EXPECT_FALSE(path(1e-3, {24e-3}).is_close_to(best));
    // The models do not call it faster, not even at the low end of their interval: 4 exp(-1.645 /
    // 10).
    EXPECT_FALSE(path(4e-3, {18e-3}).is_close_to(best));
    EXPECT_TRUE(path(3.4e-3, {18e-3}).is_close_to(best));
    EXPECT_TRUE(path(4e-3, {8e-3}).is_close_to(best)) << "few runs scatter by so much";
}

TEST(Contender, OneGoodRunKeepsATimedPathInTheRace) {
    const Contender best = path(1, {1, 1, 1});
    EXPECT_TRUE(path(1, {1.29, 2, 2}).is_close_to(best));
    EXPECT_FALSE(path(1, {1.31, 1.4, 1.4}).is_close_to(best));
}

TEST(Contender, IsSureWithSevenRuns) {
    EXPECT_FALSE(path(1, {1, 1, 1, 1, 1, 1}).is_sure());
    EXPECT_TRUE(path(1, {1, 1, 1, 1, 1, 1, 1}).is_sure());
}

TEST(Contender, RunsAndModelsAreWeighedByTheirSpreads) {
    const Contender measured = path(1, {2, 2, 2, 2, 2, 2, 2});
    // Deviations 0.06 of runs and 0.15 of models: weights 278 and 44 of the logarithms.
    EXPECT_NEAR(measured.belief(1).seconds, std::exp2(277.8 / (277.8 + 44.44)), 1e-3);
    EXPECT_NEAR(measured.belief(1).spread, 1 / std::sqrt(277.8 + 44.44), 1e-4);
    // A machine that is half as fast for all paths says nothing against the models.
    EXPECT_NEAR(measured.belief(2).seconds, 2, 1e-12);
    // Models of a path that they know nothing of have no say.
    EXPECT_EQ(path(0, {2, 2, 2, 2}).belief(1).seconds, 2);
}

TEST(Contender, RunsThatScatterAreBelievedLess) {
    EXPECT_LT(path(1, {1.2, 2, 2, 3, 3}).belief(1).seconds,
              path(1, {2, 2, 2, 2, 2}).belief(1).seconds);
}

TEST(Contender, WithoutRunsIsNeverTheFastest) {
    EXPECT_EQ(path(1, {}).least(), std::numeric_limits<double>::infinity());
    EXPECT_EQ(path(1, {}).typical(), std::numeric_limits<double>::infinity());
    EXPECT_EQ(path(1, {}).belief(1).seconds, std::numeric_limits<double>::infinity());
    EXPECT_FALSE(path(1, {}).is_timed());
}

}  // namespace
}  // namespace edgewise::cli
