#include "io/channel_colours.hpp"

#include <gtest/gtest.h>

#include "tests/io/store_testing.hpp"

namespace edgewise::store {
namespace {

using namespace testing;

TEST(ChannelColours, Words) {
    EXPECT_EQ(colour_of("Red"), (Colour{1, 0, 0}));
    EXPECT_EQ(colour_of("gray"), colour_of("GREY"));
    EXPECT_EQ(colour_of("#00FF33"), (Colour{0, 1, 0.2}));
    EXPECT_EQ(colour_of("00ff33"), (Colour{0, 1, 0.2}));
    for (const char* none : {"", "#", "#00ff3", "#00ff333", "00fg33", "+1ff33", "rot", "##00ff33"})
        EXPECT_FALSE(colour_of(none)) << none;
    for (const char* text : {"#000000", "#ffffff", "#0180fe"})
        EXPECT_EQ(text_of(*colour_of(text)), text);
}

TEST(ChannelColours, ByNumberTheyComeAgain) {
    for (int channel = 0; channel < 20; ++channel)
        for (int other = 0; other < channel; ++other)
            EXPECT_EQ(colour_by_number(channel) == colour_by_number(other),
                      (channel - other) % 7 == 0);
    EXPECT_EQ(colour_by_number(1), (Colour{0, 1, 0}));
}

TEST(ChannelColours, OtherFilesSayNone) {
    Scratch scratch;
    EXPECT_TRUE(channel_colours(scratch.put("a.nrrd", "NRRD0004\n")).empty());
    EXPECT_TRUE(channel_colours(scratch.put("empty.tif", "")).empty());
    EXPECT_TRUE(channel_colours(scratch.path("missing.tif")).empty());
    EXPECT_TRUE(channel_colours("raw:none:2x2x2:u8").empty());
}

}  // namespace
}  // namespace edgewise::store
