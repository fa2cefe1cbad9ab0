#include "charts/csv.hpp"

#include <gtest/gtest.h>

namespace edgewise::charts {
namespace {

TEST(Csv, HasTheColumnsThatScriptsReadAndLeavesUnknownsEmpty) {
    Table table;
    Point point;
    point.path = "a/x=1 > b";
    point.predicted = {0.5, {}, 1024};
    point.measured = {0.1, 0, 2048};
    point.front = true;
    table.points = {point};
    EXPECT_EQ(to_csv(table),
              "plan,predicted_seconds,measured_seconds,predicted_error,measured_error,"
              "predicted_bytes,measured_bytes,front\n"
              "a/x=1 > b,0.5,0.1,,0,1024,2048,1\n");
}

TEST(Csv, NumbersReadBackAsTheyWere) {
    Table table;
    Point point;
    const double third = 1.0 / 3;
    point.measured.seconds = third;
    table.points = {point};
    const std::string csv = to_csv(table);
    const std::size_t at = csv.find("\n,,") + 3;
    EXPECT_EQ(std::stod(csv.substr(at)), third);
}

TEST(Csv, TextsWithSeparatorsAreQuoted) {
    Table table;
    table.points.resize(1);
    table.points[0].path = "say \"a,b\"";
    EXPECT_NE(to_csv(table).find("\n\"say \"\"a,b\"\"\","), std::string::npos);
}

TEST(Csv, ASweepHasItsOptionAsLastColumn) {
    Table table;
    table.swept = "rotate.z";
    table.points.resize(1);
    table.points[0].at = 2.5;
    const std::string csv = to_csv(table);
    EXPECT_NE(csv.find(",front,rotate.z\n"), std::string::npos);
    EXPECT_TRUE(csv.ends_with(",0,2.5\n"));
}

}  // namespace
}  // namespace edgewise::charts
