#include "graph/words.hpp"

#include <gtest/gtest.h>

namespace edgewise {
namespace {

const std::vector<std::string> kModes = {"mip", "xray", "mean", "composite"};

TEST(Words, AreTheSameInAnyCase) {
    EXPECT_TRUE(same_word("MIP", "mip"));
    EXPECT_TRUE(same_word("", ""));
    EXPECT_FALSE(same_word("mip", "mi"));
    EXPECT_EQ(lower("Ray_Cast/\xc3\x84"), "ray_cast/\xc3\x84");  // bytes beyond ASCII stay
}

TEST(Words, FindTheNearestName) {
    const std::pair<const char*, const char*> cases[] = {{"mpi", "mip"},
                                                         {"x-ray", "xray"},
                                                         {"XRYA", "xray"},
                                                         {"maen", "mean"},
                                                         {"comp", "composite"},
                                                         {"minip", "mip"},
                                                         {"composit", "composite"},
                                                         {"composites", "composite"}};
    for (const auto& [typed, meant] : cases) EXPECT_EQ(nearest_name(typed, kModes), meant) << typed;
    for (const char* far : {"", "surface", "q", "banana"})
        EXPECT_EQ(nearest_name(far, kModes), "") << far;
    EXPECT_EQ(nearest_name(std::string(1 << 20, 'm'), kModes), "");  // and at once
}

TEST(Words, AreAnsweredByOneNameOrByFewOrByWhereTheyAre) {
    EXPECT_EQ(instead_of("mpi", kModes), "did you mean mip?");
    EXPECT_EQ(instead_of("banana", kModes), "expected one of mip, xray, mean, composite");
    EXPECT_EQ(instead_of("banana", kModes, "look there"), "look there");
    EXPECT_EQ(instead_of("banana", std::vector<std::string>(40, "name")), "");
}

}  // namespace
}  // namespace edgewise
