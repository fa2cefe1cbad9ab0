#include "cli/machine/pace.hpp"

#include <chrono>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>

#include "cli/machine/data_lines.hpp"
#include "cli/machine/machine.hpp"
#include "cli/machine/paced_runs.hpp"
#include "cli/machine/warming.hpp"
#include "runtime/memory_budget.hpp"

namespace edgewise::cli {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr Pace kBest{1, 26e-9};

TEST(Pace, IsMeasuredAndTheBestIsRemembered) {
    double least = kNever;
    for (int i = 0; i < 50; ++i) {
        const Pace pace = pace_now(1);
        least = std::min(least, pace.loop);
        EXPECT_EQ(pace.hop, 0) << "there is nowhere to go";
    }
    // Tens of thousands of loads: not nothing, and no thread waits for ever.
    EXPECT_GT(least, 1e-7);
    ASSERT_TRUE(std::isfinite(least));
    EXPECT_LE(best_pace(1).loop, least);
}

TEST(Pace, LoopAndHopAreOfProcessorsThatMet) {
    if (usable_cores() < 2) GTEST_SKIP() << "one processor";
    // They need not meet: another program may have one of the processors all the time.
    for (int i = 0; i < 200; ++i) {
        const Pace pace = pace_now(2);
        EXPECT_EQ(std::isfinite(pace.loop), std::isfinite(pace.hop));
        EXPECT_GT(pace.hop, 1e-9) << "not even one core hands a line to itself as fast";
        EXPECT_LE(best_pace(2).loop, pace.loop);
    }
}

TEST(Pace, IsCalmNearTheBest) {
    EXPECT_TRUE(is_calm({1.05, 0}, {1, 0}));
    EXPECT_FALSE(is_calm({2.3, 0}, {2, 0}));
    EXPECT_FALSE(is_calm({kNever, 0}, {1, 0}));
    // Near each other, and under third-level caches of their own.
    EXPECT_TRUE(is_calm({1, 40e-9}, {1, 26e-9}));
    EXPECT_FALSE(is_calm({1, 157e-9}, {1, 26e-9}));
}

TEST(Pace, RunsOfDataThatAreFarAreNotCalm) {
    constexpr double kHere = 17e-9, kFar = 110e-9;
    PacedRuns runs;
    for (int i = 0; i < 3; ++i) {
        runs.add(1e-3, {kBest, kBest, (1 + 0.1 * i) * kHere});
        runs.add(1.4e-3, {kBest, kBest, 0.5 * kFar});
        runs.add(2e-3, {kBest, kBest, kFar});
    }
    EXPECT_EQ(runs.calm(kBest), 3u);
    EXPECT_EQ(runs.seconds(kBest, 1), std::vector<double>(3, 1e-3));
    EXPECT_EQ(runs.seconds(kBest, 4),
              (std::vector<double>{1e-3, 1e-3, 1e-3, 1.4e-3, 1.4e-3, 1.4e-3}))
        << "all that are as near";
    EXPECT_NEAR(runs.undisturbed(kBest), 1e-3, 1e-12);
    // Nothing tells how near they could be where they never were.
    PacedRuns far;
    for (int i = 0; i < 4; ++i) far.add((2 + i) * 1e-3, {kBest, kBest, kFar});
    EXPECT_EQ(far.calm(kBest), 4u);
    EXPECT_NEAR(far.undisturbed(kBest), 2.6e-3, 1e-12) << "the 0.2 quantile of 2 to 5";
    // What is met elsewhere tells.
    far.join(runs);
    EXPECT_EQ(far.calm(kBest), 3u);
    // Small data are near anyway.
    PacedRuns near;
    for (int i = 0; i < 3; ++i) near.add(1e-3, {kBest, kBest});
    EXPECT_EQ(near.calm(kBest), 3u);
}

TEST(Pace, HowMuchWorseTheMachineWasIsThatOfTheRunsThatCount) {
    PacedRuns runs;
    for (int i = 0; i < 5; ++i) runs.add(1e-3, {{1, 26e-9}, {1.06, 26e-9}, 17e-9});
    for (int i = 0; i < 9; ++i) runs.add(2e-3, {{1.6, 157e-9}, {1.6, 157e-9}, 110e-9});
    const PacedRuns::Worse calm = runs.counted({1, 26e-9}, 5).worse;
    EXPECT_DOUBLE_EQ(calm.loop, 1.03);
    EXPECT_DOUBLE_EQ(calm.hop, 1);
    EXPECT_DOUBLE_EQ(calm.line, 1);
    EXPECT_DOUBLE_EQ(calm.nearest, 17e-9);
    EXPECT_TRUE(calm.calm);
    const PacedRuns::Worse all = runs.counted({1, 26e-9}, 14).worse;
    EXPECT_DOUBLE_EQ(all.loop, 1.6);
    EXPECT_DOUBLE_EQ(all.hop, 157.0 / 26);
    EXPECT_DOUBLE_EQ(all.line, 110.0 / 17);
    EXPECT_FALSE(all.calm);
}

TEST(Pace, DataAreAsNearAsOthersAsLarge) {
    MemoryBudget memory(std::size_t{1} << 28);
    const auto look = [&](double bytes) {
        Representation what;
        what.type = Type::u8;
        what.extent = {static_cast<std::int64_t>(bytes), 1, 1};
        Data data = Data::make(what, &memory);
        std::memset(data.samples.data(), 1, static_cast<std::size_t>(bytes));
        return line_seconds(data);
    };
    constexpr double kSize = 96 << 20;  // more than other tests look at
    const double large = look(2 * kSize);
    EXPECT_EQ(nearest_line(2 * kSize), large);
    EXPECT_EQ(nearest_line(2.1 * kSize), large) << "about as large";
    EXPECT_EQ(nearest_line(3 * kSize), 0) << "nothing was as large";
    EXPECT_LE(nearest_line(kSize), large) << "smaller data are no farther";
    const double small = look(kSize);
    EXPECT_EQ(nearest_line(kSize), std::min(small, large));
    EXPECT_EQ(nearest_line(2 * kSize), large) << "larger ones may be";
    EXPECT_EQ(nearest_line(1 << 20), 0) << "the processors' own caches hold that";
    // Runs of one path that were all far are not calm where others were near.
    PacedRuns runs;
    const double near = nearest_line(kSize);
    for (int i = 0; i < 3; ++i) runs.add(1e-3, {kBest, kBest, 2 * near, kSize});
    EXPECT_EQ(runs.calm(kBest), 0u);
    for (int i = 0; i < 3; ++i) runs.add(1e-3, {kBest, kBest, 1.5 * near, kSize});
    EXPECT_EQ(runs.calm(kBest), 3u);
}

TEST(Pace, LinesOfLargeDataAreLookedAt) {
    MemoryBudget memory(std::size_t{1} << 28);
    const auto lines_of = [&](std::int64_t samples) {
        Representation what;
        what.type = Type::u8;
        what.extent = {samples, 1, 1};
        Data data = Data::make(what, &memory);
        std::memset(data.samples.data(), 1, static_cast<std::size_t>(samples));
        double least = kNever;
        for (int i = 0; i < 20; ++i) least = std::min(least, line_seconds(data));
        return least;
    };
    EXPECT_EQ(lines_of(1 << 20), 0) << "the processors' own caches hold that";
    const double large = lines_of(64 << 20);
    EXPECT_GT(large, 1e-9) << "no first cache answers as soon";
    EXPECT_TRUE(std::isfinite(large));
}

TEST(Pace, CalmRunsCountAndOthersOnlyWhereTheyAreTooFew) {
    PacedRuns runs;
    runs.add(1.0, {{1}, {1}});
    runs.add(1.7, {{1.7}, {1.7}});
    runs.add(1.1, {{1}, {1.1}});
    runs.add(1.3, {{1}, {1.4}});
    EXPECT_EQ(runs.calm(kBest), 2u);
    EXPECT_EQ(runs.seconds(kBest, 1), (std::vector<double>{1.0, 1.1}));
    EXPECT_EQ(runs.seconds(kBest, 3), (std::vector<double>{1.0, 1.1, 1.3}));
    EXPECT_EQ(runs.seconds(kBest, 9).size(), 4u);
    runs.disturbed_from(2);
    EXPECT_EQ(runs.seconds(kBest, 1), (std::vector<double>{1.0}));
    EXPECT_EQ(runs.seconds(kBest, 2), (std::vector<double>{1.0, 1.7}));
}

TEST(Pace, RunsOfUnknownPaceAreAllAlike) {
    PacedRuns runs;
    for (int i = 0; i < 7; ++i) runs.add(7 - i, {{1}, {kNever}});
    EXPECT_EQ(runs.seconds(kBest, 2).size(), 7u);
}

TEST(Pace, WhatIsNotCalmWasWaitedFor) {
    for (int i = 0; i < 20; ++i) {
        const auto begin = std::chrono::steady_clock::now();
        const Pace pace = i % 2 ? calm_pace(1) : await_calm(1, 1e-3);
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
        EXPECT_TRUE(is_calm(pace, best_pace(1)) || took.count() >= (i % 2 ? 4e-4 : 1e-3));
    }
}

TEST(Pace, MoreThreadsThanProcessorsAreAsManyAsThereAre) {
    // They need not come together: another program may have the processors all the time.
    for (int i = 0; i < 10; ++i) EXPECT_GT(pace_now(1000).loop, 0);
    EXPECT_EQ(best_pace(1000).loop, best_pace(usable_cores()).loop);
}

/// @param far  times that data are farther than they can be, after each run
int warmed(double expected, const std::vector<double>& runs, double far = 5) {
    Warming warming(expected);
    std::size_t ran = 0;
    while (warming.goes_on() && ran < runs.size()) warming.ran(runs[ran++], far);
    return static_cast<int>(ran);
}

TEST(Pace, BriefRunsAreWarmedMoreOften) {
    const auto even = [](double seconds) {
        return warmed(seconds, std::vector<double>(20, seconds));
    };
    EXPECT_EQ(even(1e-6), 6);
    EXPECT_EQ(even(0), 6);
    EXPECT_EQ(even(1e-3), 6);
    EXPECT_EQ(even(4e-3), 2);
    EXPECT_EQ(even(0.04), 1);
    EXPECT_EQ(even(0.05), 0);
    EXPECT_EQ(warmed(1e-4, std::vector<double>(20, 1e-4), 1), 2) << "data are near";
    EXPECT_EQ(warmed(1e-3, {0.06, 0.06}), 1) << "it was not so brief";
    EXPECT_EQ(warmed(0.06, {}), 0);
}

TEST(Pace, RunsThatBecomeFasterAreNotWarmYet) {
    EXPECT_EQ(warmed(2e-3, {2e-3, 1.99e-3, 1.98e-3}, 1), 2) << "that is noise";
    EXPECT_EQ(warmed(2e-3, {2e-3, 1.9e-3, 1.8e-3, 1.79e-3, 1.5e-3}, 1), 4);
    EXPECT_EQ(warmed(1e-2, {5e-2, 4e-2}), 1) << "long ones need no other";
    EXPECT_EQ(warmed(0.04, {0.035, 0.034, 0.033}), 1)
        << "the first of them had nothing to be compared with";
    std::vector<double> faster;
    for (int i = 0; i < 30; ++i) faster.push_back(1e-3 * std::pow(0.9, i));
    EXPECT_EQ(warmed(1e-3, faster), 16) << "it has an end";
}

TEST(Pace, BriefRunsCountSeveralInARow) {
    EXPECT_GT(runs_in_a_row(1e-4), 1);
    EXPECT_EQ(runs_in_a_row(0.01), 1);
}

TEST(Pace, SlowRunsAreBroughtToCalmOnes) {
    // A machine that takes 1.6 times as long in all but one of the runs, and once 100 times.
    PacedRuns runs;
    runs.add(1e-3, {{1}, {1.02}});
    for (int i = 0; i < 19; ++i) runs.add(1.6e-3, {{1.6}, {1.6}});
    runs.add(0.16, {{1.6}, {1.6}});
    EXPECT_NEAR(runs.undisturbed(kBest), 1.1e-3, 1e-12) << "a loop of 1.1 is calm still";
    // Brief looks that met a slow moment make a run that was not slowed seem faster, by what they
    // are beyond calm ones: 1.12 of 1.1.
    PacedRuns brief;
    for (int i = 0; i < 20; ++i) brief.add(1e-3, {{i % 2 ? 1.0 : 1.12}, {i % 2 ? 1.0 : 1.15}});
    EXPECT_NEAR(brief.undisturbed(kBest), 1e-3 * 1.1 / 1.12, 1e-9);
    // Runs of unknown pace are left out, unless there is nothing else.
    PacedRuns unknown;
    for (int i = 0; i < 9; ++i) unknown.add(1.6e-3, {{1.7}, {1.7}});
    unknown.disturbed_from(2);
    EXPECT_NEAR(unknown.undisturbed(kBest), 1.6e-3, 1e-12);
}

TEST(Pace, AnInterruptedLoopMakesNoRunFaster) {
    PacedRuns runs;
    for (int i = 0; i < 4; ++i) {
        runs.add(1e-3, {{1}, {1}});
        runs.add(1e-3, {{1}, {100}});  // interrupted after the run
        runs.add(1e-3, {{3}, {50}});   // before and after it
    }
    EXPECT_NEAR(runs.undisturbed(kBest), 1e-3, 1e-12);
}

TEST(Pace, RunsOfProcessorsFarFromEachOtherAreNoMeasure) {
    constexpr Pace kNear{1, 28e-9}, kFar{1, 157e-9};
    PacedRuns runs;
    for (int i = 0; i < 9; ++i) runs.add(2e-3, {kFar, kFar});
    EXPECT_EQ(runs.calm(kBest), 0u);
    EXPECT_EQ(runs.seconds(kBest, 3).size(), 9u) << "none is better than another";
    EXPECT_NEAR(runs.undisturbed(kBest), 2e-3, 1e-12) << "there is nothing else";
    // They moved during one of the runs; and a busy sibling is less than being far.
    runs.add(1.9e-3, {kFar, kNear});
    for (int i = 0; i < 3; ++i) runs.add(1.2e-3, {{1.05, 28e-9}, {1.05, 28e-9}});
    runs.add(1.3e-3, {{1.3, 28e-9}, {1.3, 28e-9}});
    EXPECT_EQ(runs.calm(kBest), 3u);
    EXPECT_EQ(runs.seconds(kBest, 4), (std::vector<double>{1.2e-3, 1.2e-3, 1.2e-3, 1.3e-3}));
    EXPECT_LT(runs.undisturbed(kBest), 1.21e-3);
}

TEST(Pace, RunsOfOneThingCountTogether) {
    PacedRuns all, more;
    all.add(2e-3, {{1}, {1}});
    for (int i = 0; i < 9; ++i) more.add(1e-3, {{1}, {1}});
    all.join(more);
    EXPECT_EQ(all.size(), 10u);
    EXPECT_NEAR(all.undisturbed(kBest), 1e-3, 1e-12);
}

TEST(Pace, WhatOnlyAddsIsNoPartOfAnUndisturbedRun) {
    // Calm by the pace, and yet half of the runs waited for memory that others read.
    PacedRuns runs;
    for (int i = 0; i < 20; ++i) runs.add(i % 2 ? 1e-3 : (1.1 + 0.1 * i) * 1e-3, {{1}, {1}});
    runs.add(0.1, {{1}, {1}});
    EXPECT_NEAR(runs.undisturbed(kBest), 1e-3, 1e-12);
}

// The last one: from here on no moment is calm.
TEST(Pace, WhatAnotherProcessFoundCounts) {
    const Pace before = pace_now(1);
    know_pace(1, {before.loop * 100, 0});
    EXPECT_LE(best_pace(1).loop, before.loop) << "a slower one says nothing";
    const double faster = best_pace(1).loop / 2;
    know_pace(1, {faster, 0});
    EXPECT_EQ(best_pace(1).loop, faster);
}

}  // namespace
}  // namespace edgewise::cli
