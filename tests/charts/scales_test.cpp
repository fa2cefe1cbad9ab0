#include "charts/scales.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <set>

#include "charts/axes.hpp"
#include "charts/families.hpp"

namespace edgewise::charts {
namespace {

TEST(LogAxis, HoldsAllValuesWithRoom) {
    const double values[] = {0.003, 0.2, 0.05};
    const LogAxis axis = log_axis(values, plain_text);
    EXPECT_LT(axis.low, 0.003);
    EXPECT_GT(axis.high, 0.2);
    EXPECT_FALSE(axis.zero);
    for (const double value : values) EXPECT_EQ(axis.place(value), value);
}

TEST(LogAxis, ZeroHasAPlaceBelowAllOthersAndATick) {
    const double values[] = {0, 0.001, 0.1};
    const LogAxis axis = log_axis(values, plain_text);
    ASSERT_TRUE(axis.zero);
    EXPECT_LT(axis.low, *axis.zero);
    EXPECT_LT(*axis.zero, 0.001);
    EXPECT_EQ(axis.place(0), *axis.zero);
    EXPECT_EQ(axis.ticks.front().text, "0");
    EXPECT_EQ(axis.ticks.front().at, *axis.zero);
    // No other tick stands below the values, where the axis is no scale.
    EXPECT_GT(axis.ticks.at(1).at, *axis.zero);
}

TEST(LogAxis, TicksLieOnTheAxisAndAscendAndAreFew) {
    for (const double span : {1.1, 3., 40., 1e3, 1e6, 1e12}) {
        const double values[] = {0.0137, 0.0137 * span};
        const LogAxis axis = log_axis(values, plain_text);
        EXPECT_LE(axis.ticks.size(), 14u) << span;
        for (std::size_t i = 0; i < axis.ticks.size(); ++i) {
            EXPECT_GE(axis.ticks[i].at, axis.low);
            EXPECT_LE(axis.ticks[i].at, axis.high);
            if (i > 0) {
                EXPECT_GT(axis.ticks[i].at, axis.ticks[i - 1].at);
            }
        }
    }
}

TEST(LogAxis, WhatCannotBeDrawnIsLeftOut) {
    const double values[] = {-1, std::numeric_limits<double>::infinity(), std::nan(""), 2};
    const LogAxis axis = log_axis(values, plain_text);
    EXPECT_LT(axis.high, 10);
    EXPECT_TRUE(std::isfinite(axis.low));
    EXPECT_GT(log_axis({}, plain_text).high, log_axis({}, plain_text).low);
    const double nothing[] = {0, 0};
    EXPECT_TRUE(log_axis(nothing, plain_text).zero);
}

TEST(LogAxis, BudgetsAndPeersHaveTheirPlaceToo) {
    Table table;
    table.peers = {{"other", 100, 0.5}};
    table.error_budget = 1e-6;
    EXPECT_GT(seconds_axis(table).high, 100);
    EXPECT_LT(error_axis(table).low, 1e-6);
}

TEST(Texts, OfSeconds) {
    EXPECT_EQ(seconds_text(0.0012), "1.2 ms");
    EXPECT_EQ(seconds_text(2), "2 s");
    EXPECT_EQ(seconds_text(20e-6), "20 µs");
    EXPECT_EQ(seconds_text(0.99999e-3), "1 ms");
}

TEST(Families, KeepTheirOrderAndPairsOfColourAndShapeDiffer) {
    Table table;
    for (const char* name : {"b", "a", "b", "c"}) {
        table.points.emplace_back();
        table.points.back().family = name;
    }
    EXPECT_EQ(families_of(table), (std::vector<std::string>{"b", "a", "c"}));
    std::set<std::pair<std::string, std::string>> pairs;
    for (std::size_t i = 0; i < 42; ++i) pairs.insert({style_of(i).colour, style_of(i).shape});
    EXPECT_EQ(pairs.size(), 42u);
}

}  // namespace
}  // namespace edgewise::charts
