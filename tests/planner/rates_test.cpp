#include "planner/rates.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "graph/errors.hpp"

namespace edgewise {
namespace {

Timed timed(double counted, double ratio, double shared = 0.5) {
    return {.counted = counted,
            .alone = counted * ratio,
            .together = counted * ratio * shared,
            .runs = 3};
}

TEST(Rates, RunBetweenSizesByLogarithms) {
    const Rates rates = rates_of({{"e/f=x mip u8", {timed(10, 4, 0.8), timed(1000, 1, 0.6)}}});
    const Rate middle = rates.at("e/f=x mip u8", 100);
    EXPECT_NEAR(middle.ratio, 2, 1e-4);
    EXPECT_NEAR(middle.shared, 0.7, 1e-6) << "10 us of set-up over the least of 10 s";
    EXPECT_NEAR(rates.at("e/f=x mip u8", 10).ratio, 4, 1e-12);
    EXPECT_NEAR(rates.at("e/f=x mip u8", 1).ratio, 4, 1e-3);
    EXPECT_NEAR(rates.at("e/f=x mip u8", 1e5).ratio, 1, 1e-6);
}

TEST(Rates, SetUpDoesNotGoAwayWithTheSize) {
    // 20 us for whatever runs, and twice what is counted.
    const auto took = [](double counted) { return 2e-5 + 2 * counted; };
    const auto both = [&](double counted) { return timed(counted, took(counted) / counted); };
    const Rates rates = rates_of({{"e mip u8", {both(1e-5), both(1e-3)}}});
    for (const double counted : {1e-8, 1e-6, 1e-4, 1e-2})
        EXPECT_NEAR(counted * rates.at("e mip u8", counted).ratio / took(counted), 1, 1e-9);
}

TEST(Rates, SecondsApartAreTakenAsTheyAre) {
    // Loops take a fifth of what is counted for them, other than what is apart.
    const auto took = [](double loops, double apart) { return 0.2 * (loops + 1e-5) + apart; };
    const auto both = [&](double loops, double apart) {
        const double alone = took(loops, apart);
        return Timed{.counted = loops + apart,
                     .apart = apart,
                     .alone = alone,
                     .together = alone / 2,
                     .runs = 3};
    };
    const Rates rates = rates_of({{"e/f=x mip u8", {both(1e-3, 0), both(4e-3, 2e-4)}},
                                  {"e/f=x mip f32", {both(1e-3, 3e-4)}}});
    for (const double loops : {2e-4, 2e-3, 3e-2})
        for (const double share : {0.0, 0.1, 0.8})
            for (const char* name :
                 {"e/f=x mip u8", "e/f=x mip f32", "e/f=x xray u8", "e/f=y u8"}) {
                const double apart = share * loops;
                const Rate rate = rates.at(name, {loops + apart, apart});
                EXPECT_NEAR((loops + apart) * rate.ratio / took(loops, apart), 1, 1e-9)
                    << name << ' ' << loops << ' ' << share;
            }
    const Rates back = rates_of(to_json(rates), "m.json");
    EXPECT_EQ(back.at("e/f=x mip u8", {3e-3, 1e-3}).ratio,
              rates.at("e/f=x mip u8", {3e-3, 1e-3}).ratio);
}

TEST(Rates, WhereWhatIsApartExplainsMoreThanWasMeasuredLoopsStillTakeTime) {
    const Rates rates = rates_of(
        {{"e mip u8",
          {{.counted = 3e-3, .apart = 2e-3, .alone = 1e-3, .together = 5e-4, .runs = 3}}}});
    EXPECT_NEAR(3e-3 * rates.at("e mip u8", {3e-3, 2e-3}).ratio, 1e-3, 1e-9) << "as was measured";
    EXPECT_GT(rates.at("e mip u8", {5e-3, 2e-3}).ratio * 5e-3, 1e-3);
}

TEST(Rates, FarBeyondTheMeasuredSizesAreLessCertain) {
    const Rates rates = rates_of({{"e mip u8", {timed(1e-3, 2)}}});
    EXPECT_GT(rates.at("e mip u8", 1e-1).spread, rates.at("e mip u8", 1e-2).spread);
    EXPECT_GT(rates.at("e mip u8", 1e-2).spread, rates.at("e mip u8", 1e-3).spread);
}

TEST(Rates, BeyondTheMeasuredSizesGoOnAsAtTheLastWhateverOthersDo) {
    const Rates rates = rates_of({{"e/step=2 mip i16", {timed(2, 1.5), timed(8, 3)}},
                                  {"e/step=2 mip f32", {timed(1, 9), timed(100, 1)}}});
    constexpr double kSmall = 1e-4;  // the 10 us of set-up, over a second, several times
    EXPECT_NEAR(rates.at("e/step=2 mip i16", 1).ratio, 1.5, kSmall);
    EXPECT_NEAR(rates.at("e/step=2 mip i16", 1e3).ratio, 3, kSmall);
}

TEST(Rates, OneOutlierOfAHundredTimesMovesNothing) {
    std::vector<Timed> clean, dirty;
    for (int i = 0; i < 9; ++i) clean.push_back(timed(1e-3 * (1 + 0.01 * i), 2 + 0.001 * i));
    dirty = clean;
    dirty[0].alone *= 100;
    const double before = rates_of({{"e", clean}}).at("e", 1e-3).ratio;
    const double after = rates_of({{"e", dirty}}).at("e", 1e-3).ratio;
    EXPECT_NEAR(after / before, 1, 0.03);
}

TEST(Rates, WhatWasNotMeasuredIsServedByThoseThatShareTheMostParts) {
    const Rates rates = rates_of({{"e/f=x/s=1 mip u8", {timed(1e-3, 2)}},
                                  {"e/f=x/s=1 mip f32", {timed(1e-3, 4)}},
                                  {"e/f=x/s=1 xray u8", {timed(1e-3, 8)}},
                                  {"e/f=y/s=1 mip u8", {timed(1e-3, 32)}},
                                  {"e/f=y/s=1/bricks mip u8", {timed(1e-3, 64)}},
                                  {"else/f=x/s=2 mip u8", {timed(1e-3, 128)}}});
    // Two of this kind differ by the type: their median.
    EXPECT_NEAR(rates.at("e/f=x/s=1 mip i16", 1e-3).ratio, std::sqrt(2.0 * 4.0), 1e-9);
    // A step is not the edge's first parameter, but kind and type are the same.
    EXPECT_NEAR(rates.at("e/f=x/s=2 xray u8", 1e-3).ratio, 8, 1e-9);
    EXPECT_NEAR(rates.at("e/f=y/s=2 mip u8", 1e-3).ratio, 32, 1e-9) << "not of another way";
    EXPECT_NEAR(rates.at("e/f=x/s=1/bricks mip u8", 1e-3).ratio, 2, 1e-9)
        << "of as many parts the earlier count: the filter before the way";
    EXPECT_EQ(rates.at("other mip u8", 1e-3).ratio, 0);
    EXPECT_EQ(rates.at("e/f=x/s=1 mip u8", 0).ratio, 0) << "nothing counted, nothing predicted";
    EXPECT_GT(rates.at("e/f=y/s=2 xray u8", 1e-3).spread,
              rates.at("e/f=y/s=1 mip u8", 1e-3).spread);
}

TEST(Rates, OfSeveralFramesTellWhatThreadsShareAlone) {
    Timed frames = timed(1e-3, 9, 0.5);
    frames.frames = 100;
    const Rates rates = rates_of({{"e xray u8", {timed(1e-3, 2, 0.9), frames}}});
    EXPECT_NEAR(rates.at("e xray u8", 1e-3).ratio, 2, 1e-12);
    EXPECT_NEAR(rates.at("e xray u8", 1e-3).shared, 0.9, 1e-12);
    EXPECT_NEAR(rates.at("e xray u8", 1e-3, 450).shared, 0.5, 1e-12);
    const Rates back = rates_of(to_json(rates), "m.json");
    EXPECT_EQ(back.at("e xray u8", 1e-3, 20).shared, rates.at("e xray u8", 1e-3, 20).shared);
    EXPECT_NEAR(rates_of({{"e", {frames}}}).at("e", 1e-3).ratio, 9, 1e-12)
        << "where there are no others";
}

TEST(Rates, RunsShorterThanANamesOwnShareAsOthersSoShort) {
    const Rates rates = rates_of({{"e/f=x mip u8", {timed(1e-2, 1, 0.5), timed(2e-2, 1, 0.5)}},
                                  {"e/f=y mip u8", {timed(1e-4, 1, 0.9), timed(2e-4, 1, 0.9)}}});
    EXPECT_NEAR(rates.at("e/f=x mip u8", 1e-2).shared, 0.5, 1e-12);
    EXPECT_NEAR(rates.at("e/f=x mip u8", 9e-3).shared, 0.5, 1e-12) << "about as long";
    EXPECT_NEAR(rates.at("e/f=x mip u8", 1e-4).shared, 0.9, 1e-12);
}

TEST(Rates, GoToJsonAndBack) {
    const Rates rates =
        rates_of({{"e mip u8", {timed(1e-3, 2), timed(1e-1, 3)}}, {"g 2d f32", {timed(1, 1)}}});
    const Rates back = rates_of(to_json(rates), "m.json");
    for (const double counted : {1e-4, 1e-2, 1.0})
        for (const char* name : {"e mip u8", "g 2d f32", "e mip f32"})
            EXPECT_EQ(back.at(name, counted).ratio, rates.at(name, counted).ratio) << name;
}

TEST(Rates, BrokenOnesAreRefusedWithTheField) {
    const auto problem = [](const char* text) -> std::string {
        try {
            rates_of(nlohmann::json::parse(text), "m.json");
        } catch (const InputError& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_NE(problem("[]").find("rates"), std::string::npos);
    EXPECT_NE(problem(R"({"e": 1})").find("rates.e"), std::string::npos);
    EXPECT_NE(problem(R"({"e": [{"counted": 1}]})").find("rates.e.ratio"), std::string::npos);
    EXPECT_NE(problem(R"({"e": [{"counted": 1, "ratio": -1}]})").find("rates.e.ratio"),
              std::string::npos);
    EXPECT_NE(problem(R"({"e": [{"counted": 1, "apart": 2, "ratio": 1}]})").find("rates.e.apart"),
              std::string::npos)
        << "a part is no more than all";
}

}  // namespace
}  // namespace edgewise
