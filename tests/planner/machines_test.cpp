#include "planner/machines.hpp"

#include <algorithm>
#include <gtest/gtest.h>

namespace edgewise {
namespace {

TEST(Machines, AllAreWhole) {
    const std::vector<std::string> names = bundled_machines();
    for (const char* expected :
         {"cluster", "maspar-mp1-16k", "maspar-mp1-1k", "maspar-mp2-4k", "proteus-32"})
        EXPECT_NE(std::find(names.begin(), names.end(), expected), names.end()) << expected;
    for (const std::string& name : names) {
        const auto profile = bundled_profile(name);
        ASSERT_TRUE(profile) << name;
        EXPECT_EQ(profile->name, name);
        EXPECT_GT(profile->ranks, 1) << name;
        EXPECT_GT(profile->operation, 0) << name;
        EXPECT_GT(profile->start, 0) << name;
    }
    EXPECT_FALSE(bundled_profile("no such machine"));
}

TEST(Machines, RanksShareAllButMessages) {
    Profile profile;
    profile.operation = 1, profile.global = 10, profile.congestion = 3;
    profile.latency = 100, profile.byte = 1000, profile.start = 7, profile.serial = 0;
    const Work work{.operations = 8,
                    .traffic = {.global = 4, .congested = 2, .messages = 5, .sent = 6}};
    // 8 + (4 + 3 x 2) 10 shared by 4, and what is not shared.
    EXPECT_DOUBLE_EQ(profile.seconds("edge", work, 1, 4).seconds, 7 + 108.0 / 4 + 500 + 6000);
    EXPECT_DOUBLE_EQ(profile.seconds("edge", work, 2, 4).seconds, 7 + 108.0 / 8 + 500 + 6000);
}

}  // namespace
}  // namespace edgewise
