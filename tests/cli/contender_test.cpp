// Which contenders of a pilot are worth another run.
#include "cli/session/contender.hpp"

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

TEST(Contender, IsSureWithSevenRunsOfWhichFiveAreCalm) {
    Contender measured = path(1, {});
    for (int i = 0; i < 6; ++i) measured.runs.add(1, {{1}, {i < 5 ? 1.0 : 2.0}});
    EXPECT_FALSE(measured.is_sure({1}));
    measured.runs.add(1, {{2}, {2}});
    EXPECT_TRUE(measured.is_sure({1}));
    EXPECT_FALSE(measured.is_sure({0.5})) << "none is calm any more";
    // What an earlier pilot learned counts as it is.
    EXPECT_TRUE(path(1, {1, 1, 1}).is_sure({1}));
    EXPECT_FALSE(path(1, {1, 1}).is_sure({1}));
}

TEST(Contender, RunsAreBelievedAsFarAsTheyWereCalm) {
    const auto believed = [](double seconds, int calm) {
        Contender measured = path(1, {});
        for (int i = 0; i < 7; ++i) measured.runs.add(seconds, {{1}, {i < calm ? 1.0 : 2.0}});
        measured.choose({1});
        return measured.belief();
    };
    // Deviations 0.06 of calm runs and 0.15 of models: weights 278 and 44 of the logarithms.
    EXPECT_NEAR(believed(2, 5).seconds, std::exp2(277.8 / (277.8 + 44.44)), 1e-3);
    EXPECT_NEAR(believed(2, 5).spread, 1 / std::sqrt(277.8 + 44.44), 1e-4);
    // Without a calm one 0.06 and 0.4: weights 6.1 and 44.
    EXPECT_NEAR(believed(2, 0).seconds, std::exp2(6.112 / (6.112 + 44.44)), 1e-3);
    EXPECT_GT(believed(2, 4).seconds, believed(2, 3).seconds);
    EXPECT_NEAR(believed(1, 0).seconds, 1, 1e-12);
    // What an earlier pilot learned counts as calm.
    EXPECT_NEAR(path(1, {2, 2, 2}).belief().seconds, believed(2, 7).seconds, 1e-12);
    // Models of a path that they know nothing of have no say.
    EXPECT_EQ(path(0, {2, 2, 2}).belief().seconds, 2);
}

TEST(Contender, RunsThatScatterAreBelievedLess) {
    EXPECT_LT(path(1, {1.2, 2, 3}).belief().seconds, path(1, {2, 2, 2}).belief().seconds);
}

TEST(Contender, WithoutRunsIsNeverTheFastest) {
    EXPECT_EQ(path(1, {}).least(), std::numeric_limits<double>::infinity());
    EXPECT_EQ(path(1, {}).median(), std::numeric_limits<double>::infinity());
    EXPECT_EQ(path(1, {}).belief().seconds, std::numeric_limits<double>::infinity());
    EXPECT_FALSE(path(1, {}).is_timed());
}

}  // namespace
}  // namespace edgewise::cli
