#include <gtest/gtest.h>
#include <sstream>

#include "graph/errors.hpp"
#include "graph/mode.hpp"

namespace edgewise {
namespace {

std::string shout(std::string_view field, std::string_view value) {
    std::string said = "<" + std::string(field);
    if (!value.empty()) said += "|" + std::string(value);
    return said + ">";
}

TEST(Message, SaysItsSettingsInAnyVoice) {
    const Message said = message("@zoom: {} is not above 0; @size({}x{}) keeps {:.2f}, a@@b", 0, 3,
                                 std::string("4"), 0.5);
    EXPECT_EQ(said.text(), "zoom: 0 is not above 0; size=3x4 keeps 0.50, a@b");
    EXPECT_EQ(said.text(shout), "<zoom>: 0 is not above 0; <size|3x4> keeps 0.50, a@b");
    EXPECT_EQ(said.settings(), (std::vector<Setting>{{"zoom", ""}, {"size", "3x4"}}));
    std::ostringstream printed;
    printed << said;
    EXPECT_EQ(printed.str(), said.text());
}

TEST(Message, APlainTextNamesNoSetting) {
    for (const char* text : {"", "a@b", "@zoom", "--zoom: 0", "{} %d", "x=1"}) {
        const Message plain = text;
        EXPECT_EQ(plain.text(), text);
        EXPECT_EQ(plain.text(shout), text);
        EXPECT_TRUE(plain.settings().empty());
        EXPECT_EQ(plain, Message(std::string(text)));
    }
}

TEST(Message, WithinAnotherKeepsItsSettings) {
    const Message inner = message("@labels(1,2) or @outside"), name = setting("window", "1,2");
    const Message all = message("{}: {}; and {}", name, inner, "@zoom");
    EXPECT_EQ(all.text(), "window=1,2: labels=1,2 or outside; and @zoom");
    EXPECT_EQ(all.settings(),
              (std::vector<Setting>{{"window", "1,2"}, {"labels", "1,2"}, {"outside", ""}}));
    // As it is kept it is a text that becomes a message again.
    EXPECT_EQ(Message(all.marked()), all);
    EXPECT_EQ(message_of("first hit of @isovalue, lit").text(), "first hit of isovalue, lit");
}

TEST(Message, ArgumentsAreNoSettings) {
    const std::string file = "a@size(3).png";
    const Message said = message("{}: @out({})", file, file);
    EXPECT_EQ(said.text(), "a@size(3).png: out=a@size(3).png");
    EXPECT_EQ(said.settings(), (std::vector<Setting>{{"out", file}}));
}

TEST(Message, VerbsAreNoSettings) {
    const Message said = message("`@command(list edges)` shows all");
    EXPECT_EQ(said.text(), "`list edges` shows all");
    EXPECT_EQ(said.text(shout), "`<command|list edges>` shows all");
    EXPECT_TRUE(said.settings().empty());
}

TEST(Message, HalfAMarkIsText) {
    const std::string whole = setting("size", "fit").marked();
    for (std::size_t most = 0; most < whole.size(); ++most) {
        const Message cut = whole.substr(0, most);
        EXPECT_TRUE(cut.settings().empty());
        EXPECT_EQ(cut.text(), whole.substr(0, most));
    }
}

TEST(Errors, HoldTheirMessage) {
    const RequestError error(message("@size(fit): is cut by @crop({})", 3));
    EXPECT_STREQ(error.what(), "size=fit: is cut by crop=3");
    EXPECT_EQ(error.field(), "size");
    EXPECT_EQ(error.value(), "fit");
    EXPECT_EQ(error.message().settings().back(), (Setting{"crop", "3"}));
    const RequestError copy = error;  // NOLINT: exceptions are copied
    EXPECT_STREQ(copy.what(), error.what());
    EXPECT_EQ(copy.message(), error.message());
    EXPECT_EQ(RequestError("anything else").field(), "");
    try {
        throw InputError("a.png: broken");
    } catch (const Exception& any) {
        EXPECT_EQ(any.message().text(), "a.png: broken");
    }
}

TEST(Settings, AreSortedAndNamedOnce) {
    for (std::size_t i = 1; i < kSettings.size(); ++i) EXPECT_LT(kSettings[i - 1], kSettings[i]);
    EXPECT_TRUE(is_setting("max_error"));
    EXPECT_FALSE(is_setting("max-error"));
}

TEST(Settings, OfTheHelpOfModesAreKnown) {
    for (const Mode mode : modes())
        for (const Setting& named : message_of(mode->help).settings())
            EXPECT_TRUE(is_setting(named.field)) << mode->name << ": " << named.field;
}

}  // namespace
}  // namespace edgewise
