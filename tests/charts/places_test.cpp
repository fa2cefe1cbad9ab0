#include "charts/places.hpp"

#include <gtest/gtest.h>
#include <string>

#include "charts/axes.hpp"
#include "charts/courses.hpp"
#include "charts/front.hpp"
#include "charts/front_numbers.hpp"

namespace edgewise::charts {
namespace {

bool overlap(const Obstacle& a, const Obstacle& b) {
    return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

Obstacle box(Spot middle, double wide, double high) {
    return {middle.x - wide / 2, middle.y - high / 2, middle.x + wide / 2, middle.y + high / 2};
}

TEST(Spread, LeavesAloneWhatIsFarApart) {
    const double values[] = {40, 0, 20};
    EXPECT_EQ(spread(values, 10, 0, 100), (std::vector<double>{40, 0, 20}));
}

TEST(Spread, MovesNeighboursAboutTheirMiddleInTheirOrder) {
    const double values[] = {51, 49, 50};
    const std::vector<double> places = spread(values, 10, 0, 100);
    EXPECT_NEAR(places[1], 40, 1e-9);
    EXPECT_NEAR(places[2], 50, 1e-9);
    EXPECT_NEAR(places[0], 60, 1e-9);
}

TEST(Spread, StaysWithinItsEnds) {
    const double values[] = {0, 1, 99, 100, 100};
    const std::vector<double> places = spread(values, 10, 0, 100);
    for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_GE(places[i], 0);
        EXPECT_LE(places[i], 100);
        if (i > 0) {
            EXPECT_GE(places[i] - places[i - 1], 10 - 1e-9);
        }
    }
    EXPECT_EQ(spread({}, 10, 0, 100).size(), 0u);
}

TEST(Places, KeepOffObstaclesEachOtherAndTheEdge) {
    Room room{0, 0, 200, 200, {}};
    const std::vector<Spot> anchors = {{2, 198}, {100, 100}, {104, 103}, {108, 98}};
    for (const Spot anchor : anchors) room.obstacles.push_back(box(anchor, 14, 14));
    const std::vector<double> widths(anchors.size(), 10);
    const std::vector<Spot> places = places_beside(anchors, widths, 14, room);
    ASSERT_EQ(places.size(), anchors.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
        const Obstacle text = box(places[i], 10, 14);
        EXPECT_GE(text.left, 0);
        EXPECT_LE(text.bottom, 200);
        for (const Obstacle& obstacle : room.obstacles) EXPECT_FALSE(overlap(text, obstacle)) << i;
        for (std::size_t k = 0; k < i; ++k)
            EXPECT_FALSE(overlap(text, box(places[k], 10, 14))) << i << k;
    }
}

Table two_on_the_front() {
    Table table;
    for (const double error : {0.1, 0.099, 0.01}) {
        Point point;
        point.measured = {0.001 / error, error, 1e6};
        point.chosen = error == 0.099;
        table.points.push_back(point);
    }
    mark_front(table.points);
    return table;
}

TEST(FrontNumbers, AreOffAxesMarksAndRings) {
    const Table table = two_on_the_front();
    const LogAxis seconds = seconds_axis(table), error = error_axis(table);
    const Frame frame{100, 50, 300, 250, seconds, error};
    const auto front = front_of(table.points);
    const auto numbers = front_numbers(table, front, 9, frame);
    ASSERT_EQ(numbers.size(), front.size());
    for (const FrontNumber& number : numbers) {
        const Obstacle text = box(number.spot, 10, 14);
        EXPECT_GT(text.left, frame.left);
        EXPECT_LT(text.bottom, frame.bottom);
        for (const Point& point : table.points) {
            const double size = point.chosen ? 24 : 14;
            EXPECT_FALSE(overlap(
                text, box(frame.spot(*point.measured.seconds, *point.measured.error), size, size)));
        }
    }
    EXPECT_EQ(front_numbers(table, front, 2, frame).size(), 2u);
}

/// Three paths at four values: one chosen once, one on the front at two of them, one never.
Table sweep() {
    Table table;
    table.swept = "size";
    for (const double at : {40., 30., 20., 10.})
        for (const char* path : {"never", "half", "chosen"}) {
            Point point;
            point.path = path;
            point.family = path == std::string("half") ? "other" : "one";
            point.measured = {1, 1, 1e6};
            point.front = path == std::string("half") && at < 25;
            point.chosen = path == std::string("chosen") && at == 40;
            point.at = at;
            table.points.push_back(point);
        }
    table.points.back().measured = {};
    return table;
}

TEST(Courses, AreNumberedWhereTheyAreWorthHaving) {
    const std::vector<Course> courses = courses_of(sweep());
    ASSERT_EQ(courses.size(), 3u);
    EXPECT_EQ(courses[0].path, "chosen");
    EXPECT_EQ(courses[0].number, 1u);
    EXPECT_EQ(courses[1].path, "half");
    EXPECT_EQ(courses[1].number, 2u);
    EXPECT_EQ(courses[2].number, 0u);
    // By value, without what has no result.
    EXPECT_EQ(courses[0].points, (std::vector<std::size_t>{8, 5, 2}));
}

TEST(SweepAxes, HoldWhatIsDrawn) {
    Table table = sweep();
    for (Point& point : table.points) point.predicted = {1000, 1000, 1e6};
    table.seconds_budget = 100;
    table.error_budget = 2;
    EXPECT_LT(seconds_axis(table).high, 2);
    EXPECT_GT(error_axis(table).high, 2);
    table.swept.clear();
    EXPECT_GT(seconds_axis(table).high, 1000);
}

}  // namespace
}  // namespace edgewise::charts
