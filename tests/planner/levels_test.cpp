#include "planner/levels.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "graph/errors.hpp"
#include "planner/profile.hpp"

namespace edgewise {
namespace {

constexpr double kKilo = 1024;

/// Caches of 32 KiB and 1 MiB, and memory.
Levels three() {
    return {{.bytes = 32 * kKilo, .streamed = 1e-11, .gather = 1e-10, .spread = 0.01},
            {.bytes = 1024 * kKilo, .streamed = 2e-11, .gather = 4e-10, .spread = 0.02},
            {.streamed = 1e-10, .gather = 3e-9, .spread = 0.1}};
}

double gather_in(double set) { return cost_in(three(), &Level::gather, set); }

TEST(Levels, SetsThatFitTakeTheirLevel) {
    EXPECT_DOUBLE_EQ(gather_in(1), 1e-10);
    EXPECT_DOUBLE_EQ(gather_in(32 * kKilo), 1e-10);
    EXPECT_DOUBLE_EQ(cost_in(three(), &Level::streamed, 32 * kKilo), 1e-11);
}

TEST(Levels, LargerSetsGoOverToTheNextWithinTwiceTheSize) {
    EXPECT_DOUBLE_EQ(gather_in(32 * kKilo * std::sqrt(2)), 0.5 * 1e-10 + 0.5 * 4e-10);
    EXPECT_DOUBLE_EQ(gather_in(64 * kKilo), 4e-10);
    EXPECT_DOUBLE_EQ(gather_in(1024 * kKilo), 4e-10);
    EXPECT_DOUBLE_EQ(gather_in(2048 * kKilo), 3e-9);
    EXPECT_DOUBLE_EQ(gather_in(1e15), 3e-9);
}

TEST(Levels, NearOnesMeetTheirSizes) {
    const Levels near{{.bytes = 100, .gather = 1}, {.bytes = 150, .gather = 2}, {.gather = 3}};
    EXPECT_DOUBLE_EQ(cost_in(near, &Level::gather, 100), 1);
    EXPECT_DOUBLE_EQ(cost_in(near, &Level::gather, 150), 2);
    EXPECT_DOUBLE_EQ(cost_in(near, &Level::gather, 300), 3);
}

TEST(Levels, CostsNeverFallAndNeverJump) {
    for (double set = 1; set < 1e12; set *= 1.01) {
        for (double Level::*cost : {&Level::streamed, &Level::gather})
            EXPECT_LE(cost_in(three(), cost, set), cost_in(three(), cost, 1.01 * set)) << set;
        // From 4e-10 to 3e-9 within a factor of two: 1.44 % of the way each per cent of the size.
        EXPECT_LE(gather_in(1.01 * set), gather_in(set) + 0.0145 * (3e-9 - 4e-10)) << set;
    }
}

TEST(Levels, AnUnknownSetTakesTheLast) {
    EXPECT_EQ(gather_in(0), 3e-9);
    EXPECT_EQ(cost_in(three(), &Level::streamed, 0), 1e-10);
}

TEST(Levels, TheLastMayHaveAnEndAndServesBeyondIt) {
    const Levels one{{.bytes = 10, .gather = 2}};
    EXPECT_DOUBLE_EQ(cost_in(one, &Level::gather, 5), 2);
    EXPECT_DOUBLE_EQ(cost_in(one, &Level::gather, 5000), 2);
}

TEST(Levels, ComeBackFromJson) {
    const nlohmann::json json = to_json(three());
    EXPECT_FALSE(json.back().contains("bytes"));
    const Levels back = levels_of(json, "file");
    ASSERT_EQ(back.size(), 3u);
    EXPECT_EQ(to_json(back), json);
    EXPECT_TRUE(std::isinf(back.back().bytes));
    EXPECT_EQ(back[1].gather, 4e-10);
    EXPECT_EQ(back[2].spread, 0.1);
}

TEST(Levels, BrokenOnesAreRefusedWithTheField) {
    const auto refused = [](const char* text, const char* field) {
        try {
            parse_profile(text, "toy.json");
            ADD_FAILURE() << text;
        } catch (const InputError& error) {
            const std::string why = error.what();
            EXPECT_NE(why.find("toy.json: " + std::string(field) + ":"), why.npos) << why;
        }
    };
    refused(R"({"schema": 1, "levels": 5})", "levels");
    refused(R"({"schema": 1, "levels": {"bytes": 5}})", "levels");
    refused(R"({"schema": 1, "levels": [7]})", "levels.0");
    refused(R"({"schema": 1, "levels": [{"gather": 1e-9}]})", "levels.0.streamed");
    refused(R"({"schema": 1, "levels": [{"gather": -1, "streamed": 0}]})", "levels.0.gather");
    refused(R"({"schema": 1, "levels": [{"gather": "1", "streamed": 0}]})", "levels.0.gather");
    refused(R"({"schema": 1, "levels": [{"gather": 0, "streamed": 0, "bytes": 0}]})",
            "levels.0.bytes");
    // Only the last one has no end.
    refused(R"({"schema": 1, "levels": [{"gather": 0, "streamed": 0},
                                        {"gather": 0, "streamed": 0}]})",
            "levels.0.bytes");
    refused(R"({"schema": 1, "levels": [{"gather": 0, "streamed": 0, "bytes": 9},
                                        {"gather": 0, "streamed": 0, "bytes": 9}]})",
            "levels.1.bytes");
    refused(R"({"schema": 1, "levels": [{"gather": 2e-9, "streamed": 0, "bytes": 9},
                                        {"gather": 1e-9, "streamed": 0}]})",
            "levels.1.gather");
    refused(R"({"schema": 1, "levels": [{"gather": 0, "streamed": 1e-9, "bytes": 9},
                                        {"gather": 0, "streamed": 0}]})",
            "levels.1.streamed");
    refused(R"({"schema": 1, "levels": [{"gather": 0, "line": 2e-9, "streamed": 0, "bytes": 9},
                                        {"gather": 0, "line": 1e-9, "streamed": 0}]})",
            "levels.1.line");
    refused(R"({"schema": 1, "levels": [{"gather": 0, "streamed": 0, "spread": 11}]})",
            "levels.0.spread");
}

TEST(Levels, GoBeforeTheSingleNumbersOfAProfile) {
    Profile profile;
    profile.operation = 0;
    Work work{.streamed = 10, .swept = 16 * kKilo, .gathers = 12, .lines = {8000, 500 * kKilo}};
    EXPECT_DOUBLE_EQ(profile.counted(work).seconds, 10 * profile.streamed + 12 * profile.gather);
    profile.levels = three();
    // All reads are near, and some of them bring a line.
    for (Level& level : profile.levels) level.line = 2.5 * level.gather;
    const double near = profile.levels.front().gather;
    EXPECT_DOUBLE_EQ(profile.counted(work).seconds,
                     10 * 1e-11 + 12 * near + 8000 * 2.5 * (4e-10 - near));
    // Few lines of much data come from as far: the next run's are others.
    work.lines.count = 3;
    EXPECT_DOUBLE_EQ(profile.counted(work).seconds,
                     10 * 1e-11 + 12 * near + 3 * 2.5 * (4e-10 - near));
    work.lines.span = work.swept = 0;  // not known
    EXPECT_DOUBLE_EQ(profile.counted(work).seconds,
                     10 * 1e-10 + 12 * near + 3 * 2.5 * (3e-9 - near));
    work.lines.count = 0;
    EXPECT_DOUBLE_EQ(profile.counted(work).seconds, 10 * 1e-10 + 12 * near);
    EXPECT_EQ(profile.counted(work).apart, 0);
}

TEST(Levels, LinesAreApartFromLoops) {
    Profile profile;
    profile.levels = three();
    for (Level& level : profile.levels) level.line = 2.5 * level.gather;
    const double near = profile.levels.front().gather;
    const Work loops{.operations = 5, .gathers = 12};
    Work work = loops;
    work.lines = {100, 500 * kKilo};
    work.other_lines = {10, 16 * kKilo};  // the nearest level holds them
    const double apart = 100 * 2.5 * (4e-10 - near);
    EXPECT_DOUBLE_EQ(profile.counted(work).apart, apart);
    EXPECT_DOUBLE_EQ(profile.counted(work).seconds, profile.counted(loops).seconds + apart);
    work.other_lines.span = 500 * kKilo;
    EXPECT_DOUBLE_EQ(profile.counted(work).apart, apart + 10 * 2.5 * (4e-10 - near));
}

TEST(Levels, LinesComeBackFromBehindAllOthersOfTheirSet) {
    Levels levels = three();
    for (Level& level : levels) level.line = 2 * level.gather;
    const auto again = [&](double set) { return line_again(levels, set); };
    EXPECT_EQ(again(16 * kKilo), 0);
    // As far as what reads anywhere find of a set of twice the size.
    EXPECT_DOUBLE_EQ(again(32 * kKilo), 2 * (4e-10 - 1e-10));
    EXPECT_DOUBLE_EQ(again(1024 * kKilo), 2 * (3e-9 - 1e-10));
    EXPECT_DOUBLE_EQ(again(0), again(1e12));
    // Where reads wait for nothing levels still have to move what is read.
    for (Level& level : levels) level.line = 1e-10;
    EXPECT_DOUBLE_EQ(again(1024 * kKilo), 0.4 * 64 * (1e-10 - 1e-11));
    EXPECT_EQ(again(16 * kKilo), 0);
}

TEST(Levels, AFileWithoutThemCountsAsEver) {
    const Profile old = parse_profile(R"({"schema": 1, "gather": 1e-9, "streamed": 0})", "old");
    EXPECT_TRUE(old.levels.empty());
    for (const double span : {0.0, 1e3, 1e9})
        EXPECT_EQ(old.counted({.swept = span, .gathers = 7, .lines = {.span = span}}).seconds,
                  7 * 1e-9);
}

}  // namespace
}  // namespace edgewise
