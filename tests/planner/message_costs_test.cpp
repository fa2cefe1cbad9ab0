#include "planner/message_costs.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "graph/errors.hpp"
#include "planner/profile.hpp"

namespace edgewise {
namespace {

/// Seconds of messages alone.
double seconds(const Profile& profile, double messages, double sent) {
    return profile.seconds("edge", {.traffic = {.messages = messages, .sent = sent}}, 1).seconds;
}

Profile network() {
    Profile profile;
    profile.start = 0;
    profile.spread = 0;
    profile.latency = 1.0 / 64;
    profile.byte = 1.0 / 128;
    profile.messages = {{.bytes = 100, .latency = 1.0 / 8, .byte = 1.0 / 256},
                        {.bytes = 1000, .latency = 0.5, .byte = 1.0 / 512}};
    return profile;
}

TEST(MessageCosts, TheSegmentThatFitsTheMeanSizePrices) {
    const Profile profile = network();
    EXPECT_DOUBLE_EQ(seconds(profile, 4, 4 * 99), 4.0 / 64 + 396.0 / 128);
    EXPECT_DOUBLE_EQ(seconds(profile, 4, 4 * 100), 4.0 / 8 + 400.0 / 256);
    EXPECT_DOUBLE_EQ(seconds(profile, 1, 999), 1.0 / 8 + 999.0 / 256);
    EXPECT_DOUBLE_EQ(seconds(profile, 3, 3000), 3 * 0.5 + 3000.0 / 512);
    EXPECT_DOUBLE_EQ(seconds(profile, 1, 1e9), 0.5 + 1e9 / 512);
}

TEST(MessageCosts, NoneCostNothingAndWithoutAListTheSingleNumbersHold) {
    Profile profile = network();
    EXPECT_EQ(seconds(profile, 0, 0), 0);
    profile.messages.clear();
    EXPECT_DOUBLE_EQ(seconds(profile, 2, 1e6), 2.0 / 64 + 1e6 / 128);
}

TEST(MessageCosts, AListFromZeroOnReplacesTheSingleNumbers) {
    Profile profile = network();
    profile.messages.insert(profile.messages.begin(), {.bytes = 0, .latency = 0.25, .byte = 0});
    EXPECT_DOUBLE_EQ(seconds(profile, 2, 2), 2 * 0.25);
}

TEST(MessageCosts, ComeBackFromJson) {
    const Profile back = parse_profile(to_json(network()).dump(), "file");
    EXPECT_EQ(to_json(back), to_json(network()));
    ASSERT_EQ(back.messages.size(), 2u);
    EXPECT_EQ(back.messages[1].latency, 0.5);
}

TEST(MessageCosts, BrokenOnesAreRefusedWithTheField) {
    const auto refused = [](const std::string& messages, const char* field) {
        try {
            parse_profile(R"({"schema": 1, "messages": )" + messages + "}", "toy.json");
            ADD_FAILURE() << messages;
        } catch (const InputError& error) {
            const std::string why = error.what();
            EXPECT_NE(why.find("toy.json: " + std::string(field) + ":"), why.npos) << why;
        }
    };
    refused("{}", "messages");
    refused("null", "messages");
    refused("[3]", "messages.0");
    refused(R"([{"latency": 0, "byte": 0}])", "messages.0.bytes");
    refused(R"([{"bytes": -1, "latency": 0, "byte": 0}])", "messages.0.bytes");
    refused(R"([{"bytes": 0, "latency": "1", "byte": 0}])", "messages.0.latency");
    refused(R"([{"bytes": 0, "latency": 0, "byte": -1e-9}])", "messages.0.byte");
    // Beyond what any network takes: a wrong unit.
    refused(R"([{"bytes": 0, "latency": 2, "byte": 0}])", "messages.0.latency");
    refused(R"([{"bytes": 8, "latency": 0, "byte": 0}, {"bytes": 8, "latency": 0, "byte": 0}])",
            "messages.1.bytes");
    refused(R"([{"bytes": 8, "latency": 0, "byte": 0}, {"bytes": 4, "latency": 0, "byte": 0}])",
            "messages.1.bytes");
}

}  // namespace
}  // namespace edgewise
