#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "charts/embedded.hpp"
#include "charts/front.hpp"
#include "charts/gnuplot.hpp"
#include "charts/page.hpp"
#include "charts/program.hpp"
#include "charts/words.hpp"

namespace edgewise::charts {
namespace {

const std::string kGnuplot = "/usr/bin/gnuplot";

Table small() {
    Table table;
    table.title = "it's \"<b>\" & more\nthan one line";
    for (int i = 0; i < 3; ++i) {
        Point point;
        point.path = "path " + std::to_string(i);
        point.family = i == 2 ? "other's" : "one";
        point.predicted = {0.01 * (i + 1), 0.1 / (i + 1), 1e6};
        point.measured = {0.02 * (i + 1), i == 2 ? 0 : 0.05 / (i + 1), 1e6};
        point.chosen = i == 1;
        table.points.push_back(point);
    }
    table.points.emplace_back();  // nothing known of it
    table.points.back().path = table.points.back().family = "failed";
    table.peers = {{"rival \"q\"", 0.5, 0.02}};
    table.seconds_budget = 0.03;
    table.error_budget = 0.01;
    mark_front(table.points);
    return table;
}

nlohmann::ordered_json document_of(const Table& table) {
    nlohmann::ordered_json points = nlohmann::ordered_json::array();
    for (const Point& point : table.points)
        points.push_back({{"steps", {point.path, "</script><b>"}}});
    return {{"points", points}};
}

TEST(Words, AreSafeInScripts) {
    EXPECT_EQ(quoted("it's\n"), "'it''s '");
    EXPECT_EQ(double_quoted("a\"\\"), "\"a\\\\\"");
    EXPECT_EQ(shortened("0123456789", 10), "0123456789");
    EXPECT_EQ(shortened("0123456789", 7), "0123…89");
    EXPECT_EQ(shortened("ééééé", 4), "éé…é");
}

TEST(Program, ThatDoesNotStartIsNamed) {
    try {
        output_of({"/no/such/program"}, "");
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("/no/such/program"), std::string::npos);
    }
}

TEST(Program, TakesAndGivesMoreThanAPipeHolds) {
    const std::string much(3'000'000, 'x');
    EXPECT_EQ(output_of({"/bin/cat"}, much), much);
    EXPECT_EQ(output_of({"/bin/true"}, much), "");
}

TEST(Program, ThatFailsIsAnErrorWithWhatItSaid) {
    try {
        output_of({"/bin/sh", "-c", "echo broken >&2; exit 3"}, "");
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("broken"), std::string::npos);
    }
}

TEST(Gnuplot, DrawsWhatThereIsWithoutComplaint) {
    const std::string svg = drawn(small(), Picture::svg, kGnuplot);
    EXPECT_NE(svg.find("<svg"), std::string::npos);
    for (const char* text : {"other's", "measured", "rival", "chosen by the planner", ">0<"})
        EXPECT_NE(svg.find(text), std::string::npos) << text;
    EXPECT_EQ(svg, drawn(small(), Picture::svg, kGnuplot));
    EXPECT_EQ(drawn(small(), Picture::png, kGnuplot).substr(1, 3), "PNG");
    EXPECT_NE(drawn(Table{}, Picture::svg, kGnuplot).find("<svg"), std::string::npos);
}

TEST(Gnuplot, DrawsASweep) {
    Table table = small();
    table.swept = "rotate.z";
    table.points.pop_back();
    Table two = table;
    for (Point& point : two.points) point.at = 10;
    for (Point& point : table.points) point.at = 20;
    two.points.insert(two.points.end(), table.points.begin(), table.points.end());
    const std::string svg = drawn(two, Picture::svg, kGnuplot);
    EXPECT_NE(svg.find("rotate.z"), std::string::npos);
    EXPECT_NE(svg.find("path 2"), std::string::npos);
}

TEST(Page, CarriesD3AsItIsAndItsLicence) {
    EXPECT_GT(std::string(kD3).size(), 200'000u);
    EXPECT_NE(std::string(kD3).find("d3js.org"), std::string::npos);
    const std::string page = page_of(small(), document_of(small()), nullptr);
    EXPECT_NE(page.find(kD3), std::string::npos);
    EXPECT_NE(page.find("Redistribution and use in source and binary forms"), std::string::npos);
}

TEST(Page, NothingInTheDataEndsItsScript) {
    const std::string page = page_of(small(), document_of(small()), nullptr);
    const std::string mark = "id=\"data\">";
    const std::size_t begin = page.find(mark) + mark.size();
    const std::string data = page.substr(begin, page.find("</script>", begin) - begin);
    const auto json = nlohmann::json::parse(data);
    EXPECT_EQ(json["points"][0]["steps"][1], "</script><b>");
    EXPECT_NE(page.find("<title>it's &quot;&lt;b&gt;&quot; &amp; more"), std::string::npos);
    // Nothing is fetched: neither by elements nor by styles.
    for (const char* word : {"<link rel=\"stylesheet\"", "src=\"http", "url(http", "@import"})
        EXPECT_EQ(page.find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace edgewise::charts
