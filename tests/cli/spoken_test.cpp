#include "cli/request/spoken.hpp"

#include <gtest/gtest.h>

#include "settings/settings.hpp"

namespace edgewise::cli {
namespace {

TEST(Spoken, IsInTheWordsOfTheCommand) {
    EXPECT_EQ(spoken(message("@max_error: {} is negative", -1)), "--max-error: -1 is negative");
    EXPECT_EQ(spoken(message("@size(fit) or @spacing({})", 0.5)), "--size fit or --spacing 0.5");
    EXPECT_EQ(spoken(message("@occlusion, @cue and @lights")),
              "--ambient-occlusion, --depth-cue and --light");
    EXPECT_EQ(spoken(message("@out({}): is full", "x.png")), "-o x.png: is full");
    EXPECT_EQ(spoken(message("`@command(list edges)`")), "`edgewise list edges`");
    EXPECT_EQ(spoken(message("which @grid_moves(true) leaves")), "which --move grid leaves");
    EXPECT_EQ(spoken("--zoom: typed by hand"), "--zoom: typed by hand");
}

TEST(Spoken, WritesAnEqualsSignWhereAValueMayBeLeftOut) {
    EXPECT_EQ(spoken(message("@labels({},{})", 1, 2)), "--labels=1,2");
    EXPECT_EQ(spoken(message("@verify(all) or @labels")), "--verify=all or --labels");
}

TEST(Spoken, LeavesNoMarksOfAnySetting) {
    for (const std::string_view name : kSettings) {
        const std::string text = fmt::format("@{} and @{}(a b)", name, name);
        const std::string said = spoken(message_of(text));
        EXPECT_EQ(said.find_first_of("\x11\x12\x13@_"), std::string::npos) << said;
        EXPECT_TRUE(said.starts_with(option_of(name))) << said;
    }
}

TEST(Spoken, CallsEachSettingByTheOptionOfItsRow) {
    for (const QuerySetting* row : settings()) EXPECT_EQ(spoken(setting(row->name)), row->typed());
    EXPECT_EQ(option_of("grid_moves"), "--move");
    EXPECT_EQ(option_of("max_error"), "--max-error");
    EXPECT_EQ(option_of("machine"), "--machine");  // no field of a query
}

}  // namespace
}  // namespace edgewise::cli
