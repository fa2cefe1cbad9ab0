#include "cli/machine/pace.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>

#include "cli/machine/machine.hpp"
#include "cli/machine/quantiles.hpp"

namespace edgewise::cli {
namespace {

TEST(Pace, IsMeasuredAndTheBestIsRemembered) {
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 50; ++i) least = std::min(least, pace_now(1));
    // Tens of thousands of loads: not nothing, and no thread waits for ever.
    EXPECT_GT(least, 1e-7);
    ASSERT_TRUE(std::isfinite(least));
    EXPECT_LE(best_pace(1), least);
}

TEST(Pace, ClassesGrowWithThePace) {
    EXPECT_EQ(pace_class(1.05, 1), kCalm);
    EXPECT_EQ(pace_class(2.3, 2), kBrisk);
    EXPECT_EQ(pace_class(1.25, 1), kSlow);
    EXPECT_EQ(pace_class(1.4, 1), kSlower);
    EXPECT_EQ(pace_class(9, 1), kSlowest);
    EXPECT_EQ(pace_class(std::numeric_limits<double>::infinity(), 1), kUnknown);
}

TEST(Pace, CalmRunsCountAndOthersOnlyWhereTheyAreTooFew) {
    PacedRuns runs;
    runs.add(1.0, 1, 1);
    runs.add(1.7, 1.7, 1.7);
    runs.add(1.1, 1, 1.1);
    runs.add(1.3, 1, 1.4);
    EXPECT_EQ(runs.calm(1), 2u);
    EXPECT_EQ(runs.seconds(1, 1), (std::vector<double>{1.0, 1.1}));
    EXPECT_EQ(runs.seconds(1, 3), (std::vector<double>{1.0, 1.1, 1.3}));
    EXPECT_EQ(runs.seconds(1, 9).size(), 4u);
    runs.disturbed_from(2);
    EXPECT_EQ(runs.seconds(1, 1), (std::vector<double>{1.0}));
    EXPECT_EQ(runs.seconds(1, 2), (std::vector<double>{1.0, 1.7}));
}

TEST(Pace, RunsOfUnknownPaceAreAllAlike) {
    PacedRuns runs;
    for (int i = 0; i < 7; ++i) runs.add(7 - i, 1, std::numeric_limits<double>::infinity());
    EXPECT_EQ(runs.seconds(1, 2).size(), 7u);
}

TEST(Pace, MoreThreadsThanProcessorsAreAsManyAsThereAre) {
    // They need not come together: another program may have the processors all the time.
    for (int i = 0; i < 10; ++i) EXPECT_GT(pace_now(1000), 0);
    EXPECT_EQ(best_pace(1000), best_pace(usable_cores()));
}

TEST(Pace, BriefRunsAreWarmedMoreOften) {
    EXPECT_EQ(warming_runs(1e-6), 4);
    EXPECT_EQ(warming_runs(0), 4);
    EXPECT_EQ(warming_runs(1.5e-3), 3);
    EXPECT_EQ(warming_runs(0.01), 1);
}

TEST(Pace, SlowRunsAreBroughtToCalmOnes) {
    // A machine that takes 1.6 times as long in half of the runs, and once 100 times.
    PacedRuns runs;
    for (int i = 0; i < 20; ++i) {
        const bool slow = i % 2;
        runs.add(slow ? 1.6e-3 : 1e-3, slow ? 1.7 : 1, slow ? 1.7 : 1.02);
    }
    runs.add(0.16, 1.7, 1.7);
    Slowdowns slowdowns;
    runs.add_slowdowns(1, slowdowns);
    EXPECT_TRUE(slowdowns[kCalm].empty());
    EXPECT_EQ(slowdowns[kSlowest].size(), 11u);
    std::array<double, kPaceClasses> slowdown{};
    slowdown[kSlowest] = median(slowdowns[kSlowest]);
    EXPECT_NEAR(slowdown[kSlowest], std::log(1.6), 1e-12);
    EXPECT_NEAR(runs.undisturbed(1, slowdown), 1e-3, 1e-12);
    // Where hardly any was calm, those that were slow tell as well.
    PacedRuns slow;
    slow.add(1.2e-3, 1, 1);
    for (int i = 0; i < 9; ++i) slow.add(1.6e-3, 1.7, 1.7);
    EXPECT_NEAR(slow.undisturbed(1, slowdown), 1e-3, 1e-12);
    // Runs of unknown pace are left out, unless there is nothing else.
    slow.disturbed_from(1);
    EXPECT_NEAR(slow.undisturbed(1, slowdown), 1.6e-3, 1e-12);
}

TEST(Pace, WhatOnlyAddsIsNoPartOfAnUndisturbedRun) {
    // Calm by the pace, and yet half of the runs waited for memory that others read.
    PacedRuns runs;
    for (int i = 0; i < 20; ++i) runs.add(i % 2 ? 1e-3 : (1.1 + 0.1 * i) * 1e-3, 1, 1);
    runs.add(0.1, 1, 1);
    EXPECT_NEAR(runs.undisturbed(1, {}), 1e-3, 1e-12);
}

}  // namespace
}  // namespace edgewise::cli
