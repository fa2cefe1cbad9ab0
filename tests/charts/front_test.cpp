#include "charts/front.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <random>

namespace edgewise::charts {
namespace {

Point measured(std::optional<double> seconds, std::optional<double> error) {
    Point point;
    point.measured = {seconds, error, {}};
    return point;
}

std::vector<bool> fronts(std::vector<Point> points) {
    mark_front(points);
    std::vector<bool> front;
    for (const Point& point : points) front.push_back(point.front);
    return front;
}

TEST(Front, HoldsWhatNothingBeatsInBoth) {
    EXPECT_EQ(fronts({measured(1, 0.5), measured(2, 0.1), measured(3, 0.2), measured(4, 0)}),
              (std::vector<bool>{true, true, false, true}));
}

TEST(Front, EqualsAreOnItTogetherAndOneWorseInOneIsNot) {
    EXPECT_EQ(fronts({measured(1, 0.5), measured(1, 0.5), measured(1, 0.6), measured(2, 0.5)}),
              (std::vector<bool>{true, true, false, false}));
}

TEST(Front, WhatIsNotKnownIsNotOnItAndBeatsNothing) {
    EXPECT_EQ(fronts({measured(1, {}), measured({}, 0.1), measured(2, 0.3)}),
              (std::vector<bool>{false, false, true}));
}

TEST(Front, EachValueOfASweepHasItsOwn) {
    std::vector<Point> points{measured(1, 0.1), measured(2, 0.2)};
    points[0].at = 10;
    points[1].at = 20;
    EXPECT_EQ(fronts(points), (std::vector<bool>{true, true}));
}

TEST(Front, OrderedByTimeErrorsFallStrictly) {
    std::mt19937 bits(7);
    std::uniform_real_distribution<double> share(0, 1);
    std::vector<Point> points;
    for (int i = 0; i < 500; ++i) points.push_back(measured(share(bits), share(bits)));
    mark_front(points);
    const std::vector<std::size_t> front = front_of(points);
    ASSERT_FALSE(front.empty());
    for (std::size_t i = 1; i < front.size(); ++i) {
        EXPECT_LT(*points[front[i - 1]].measured.seconds, *points[front[i]].measured.seconds);
        EXPECT_GT(*points[front[i - 1]].measured.error, *points[front[i]].measured.error);
    }
    // Sorted by time, a point is on the front exactly where its error is the least so far.
    std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) {
        return *a.measured.seconds < *b.measured.seconds;
    });
    double least = 2;
    for (const Point& point : points) {
        EXPECT_EQ(point.front, *point.measured.error < least);
        least = std::min(least, *point.measured.error);
    }
}

}  // namespace
}  // namespace edgewise::charts
