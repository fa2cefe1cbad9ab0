#include "planner/advise.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "tests/planner/random_graph.hpp"

namespace edgewise {
namespace {

using toys::Planned;
using toys::ToyGraph;
using toys::unit_profile;

/// Two ways of one edge each and one that can never win.
ToyGraph ways(double first, double second) {
    ToyGraph toy;
    toy.frames = 1;
    toy.vertices = {{1}, {1, true}};
    toy.edges = {{0, 1, {{.operations = first}}},
                 {0, 1, {{.operations = second}}},
                 {0, 1, {{.operations = 1, .error = Error::unknown()}}}};
    return toy;
}

Advice advice_on(const Planned& planned, const Profile& profile, const std::string& build = "1") {
    const Answer answer = planned.answer(profile);
    const Candidates paths = planned.candidates(profile);
    return advise(paths, *answer.plan, profile, build);
}

const CostAdvice* cost_called(const Advice& advice, const std::string& edge) {
    for (const CostAdvice& one : advice.costs)
        if (one.name.starts_with(edge + " ")) return &one;
    return nullptr;
}

TEST(Advise, RegretIsTheMeanLossOfSimulatedChoices) {
    Planned planned(ways(10, 12));
    planned.want.budget.error = 1;
    const Advice advice = advice_on(planned, unit_profile());
    ASSERT_EQ(advice.costs.size(), 2u);  // the edge of unknown error cannot win
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal(0, 0.35);
    double first = 0, second = 0;
    constexpr int kDraws = 400000;
    for (int i = 0; i < kDraws; ++i) {
        first += std::max(0.0, 10 * std::exp(normal(random)) - 12) / kDraws;
        second += std::max(0.0, 10 - 12 * std::exp(normal(random))) / kDraws;
    }
    // 400000 draws of deviation about 2.5 leave 0.004; 256 quantiles cut 0.5 % off the tail's mean.
    EXPECT_NEAR(cost_called(advice, "toy.e0")->regret, first, 0.03);
    EXPECT_NEAR(cost_called(advice, "toy.e1")->regret, second, 0.02);
    EXPECT_DOUBLE_EQ(cost_called(advice, "toy.e0")->measuring, 30);
    EXPECT_GE(advice.costs[0].worth(), advice.costs[1].worth());
}

TEST(Advise, CostsThatCannotChangeThePlanAreLeftAlone) {
    Planned planned(ways(1, 1e6));
    planned.want.budget.error = 1;
    const Advice advice = advice_on(planned, unit_profile());
    EXPECT_TRUE(advice.costs.empty());
    EXPECT_EQ(advice.idle, 2);
}

TEST(Advise, MeasuredCostsNeedNoMeasuringUntilTheyAreStaleOrBeyondTheirSizes) {
    Planned planned(ways(10, 12));
    planned.want.budget.error = 1;
    Profile profile = unit_profile();
    profile.build = "1";
    profile.when = "2026-01-02T03:04:05Z";
    const auto measured = [&](double counted) {
        Rates::Curves curves;
        curves["toy.e0 3d u8"] = {{.counted = counted, .spread = 0.35, .runs = 3}};
        profile.rates = Rates(curves);
    };
    measured(10);
    const Advice fresh = advice_on(planned, profile);
    EXPECT_EQ(fresh.measured, 1);
    EXPECT_EQ(cost_called(fresh, "toy.e0"), nullptr);
    ASSERT_NE(cost_called(fresh, "toy.e1"), nullptr);
    EXPECT_EQ(cost_called(fresh, "toy.e1")->state, "guessed");
    const Advice stale = advice_on(planned, profile, "2");
    EXPECT_EQ(cost_called(stale, "toy.e0")->state, "stale");
    EXPECT_EQ(cost_called(stale, "toy.e0")->when, profile.when);
    measured(1);
    EXPECT_EQ(cost_called(advice_on(planned, profile), "toy.e0")->state, "beyond");
}

TEST(Advise, MissingArcsAreRankedByWhatTheyBring) {
    // 0 -> 1 is slow, 1 -> 2 is at its bound: an operation a sample.
    ToyGraph toy;
    toy.frames = 1;
    toy.vertices = {{4}, {4}, {2, true}};
    toy.edges = {{0, 1, {{.operations = 40}}}, {1, 2, {{.operations = 4}}}};
    const Advice advice = advice_on(Planned(toy), unit_profile());
    EXPECT_DOUBLE_EQ(advice.seconds, 44);
    EXPECT_DOUBLE_EQ(advice.bound, 4);
    ASSERT_EQ(advice.arcs.size(), 2u);
    EXPECT_DOUBLE_EQ(advice.arcs[0].gain, 40);  // at once
    EXPECT_EQ(advice.arcs[0].best, (std::vector<std::string>{"toy.e0", "toy.e1"}));
    EXPECT_DOUBLE_EQ(advice.arcs[1].gain, 36);  // the first step alone
    EXPECT_DOUBLE_EQ(advice.arcs[1].bound, 4);
    EXPECT_DOUBLE_EQ(advice.arcs[1].plan, 8);
}

TEST(Advise, AnEdgeThatKeepsTheErrorBudgetIsMissedWhereOnlyInaccurateOnesAreFast) {
    ToyGraph toy;
    toy.frames = 1;
    toy.vertices = {{4}, {4}, {2, true}};
    toy.edges = {{0, 1, {{.operations = 20, .error = {.bias = 9}}}},
                 {1, 2, {{.operations = 4}}},
                 {0, 2, {{.operations = 100}}}};
    Planned planned(toy);
    planned.want.budget.error = 1;
    const Advice advice = advice_on(planned, unit_profile());
    EXPECT_DOUBLE_EQ(advice.seconds, 100);
    ASSERT_EQ(advice.arcs.size(), 2u);
    EXPECT_DOUBLE_EQ(advice.arcs[0].gain, 96);
    EXPECT_DOUBLE_EQ(advice.arcs[1].gain, 92);  // 0 -> 1 without the error, then what there is
}

bool listed(const Advice& advice, const std::vector<std::string>& best) {
    return std::any_of(advice.arcs.begin(), advice.arcs.end(),
                       [&](const ArcAdvice& arc) { return arc.best == best; });
}

TEST(Advise, NothingIsMissingWhereAKnownWayIsAtTheBoundOrBelow) {
    // 0 -> 1 errs too much. All samples read once take 4; an edge that reads few of them, less.
    for (const double seconds : {0.5, 1.0, 4.0, 7.9, 8.1, 20.0}) {
        ToyGraph toy;
        toy.frames = 1;
        toy.vertices = {{4}, {4}, {2, true}};
        toy.edges = {{0, 1, {{.operations = seconds, .error = {.bias = 9}}}},
                     {1, 2, {{.operations = 4}}},
                     {0, 2, {{.operations = 100}}}};
        Planned planned(toy);
        planned.want.budget.error = 1;
        const Advice advice = advice_on(planned, unit_profile());
        EXPECT_EQ(listed(advice, {"toy.e0"}), seconds > 8) << seconds;
        EXPECT_TRUE(listed(advice, {"toy.e2"})) << seconds;
    }
}

TEST(Advise, ABoundIsNotAboveWhatAKnownWayTakes) {
    ToyGraph toy;
    toy.frames = 1;
    toy.vertices = {{400}, {2, true}};
    toy.edges = {{0, 1, {{.operations = 3}}}, {0, 1, {{.operations = 30}}}};
    const Advice few = advice_on(Planned(toy), unit_profile());
    EXPECT_DOUBLE_EQ(few.seconds, 3);
    EXPECT_DOUBLE_EQ(few.bound, 3);
    EXPECT_TRUE(few.arcs.empty());
    // An accurate way takes ten times what an inaccurate one does.
    toy.edges[0].choices[0].error = {.bias = 9};
    Planned planned(toy);
    planned.want.budget.error = 1;
    const Advice accurate = advice_on(planned, unit_profile());
    EXPECT_DOUBLE_EQ(accurate.bound, 3);
    ASSERT_EQ(accurate.arcs.size(), 1u);
    EXPECT_DOUBLE_EQ(accurate.arcs[0].seconds, 30);
    EXPECT_DOUBLE_EQ(accurate.arcs[0].bound, 3);
}

TEST(Advise, BoundsAndMissingEdgesOfRandomGraphsAgreeWithKnownWays) {
    std::mt19937 random(11);
    int graphs = 0, arcs = 0;
    for (int i = 0; i < 300; ++i) {
        Planned planned(toys::random_graph(random));
        planned.want.budget.error = 2;
        if (!planned.answer().plan) continue;
        const Advice advice = advice_on(planned, unit_profile());
        // Sums of whole numbers, but for shares of a turntable's views.
        EXPECT_LE(advice.bound, advice.seconds * (1 + 1e-12)) << i;
        for (const ArcAdvice& arc : advice.arcs) {
            EXPECT_GE(arc.seconds, 2 * arc.bound) << i << " " << arc.from << " " << arc.to;
            EXPECT_LT(arc.plan, advice.seconds) << i;
        }
        ++graphs;
        arcs += static_cast<int>(advice.arcs.size());
    }
    EXPECT_GT(graphs, 100);
    EXPECT_GT(arcs, 50);
}

}  // namespace
}  // namespace edgewise
