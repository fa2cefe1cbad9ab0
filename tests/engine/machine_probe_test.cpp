#include "measure/machine_probe.hpp"

#include <gtest/gtest.h>

namespace edgewise::cli {
namespace {

TEST(MachineProbe, FactorsAreScaledToWhatRatesSay) {
    Profile profile;
    profile.factors = {{"a.b", 2}, {"a.c", 3}, {"a.d", 8}};
    // Measured: an eighth and a quarter of what the factors say, and an edge that has none.
    profile.rates = Rates({{"a.b 3d u8", {{.counted = 1, .ratio = 0.25}}},
                           {"a.c/f=x 3d u8", {{.counted = 1, .ratio = 0.75}}},
                           {"a.e 3d u8", {{.counted = 1, .ratio = 0.2}}}});
    rebase_factors(profile);
    EXPECT_DOUBLE_EQ(profile.factor("a.d"), 8 * 0.2);
    EXPECT_DOUBLE_EQ(profile.factor("a.b"), 2 * 0.2);
    EXPECT_DOUBLE_EQ(profile.factor("unknown"), 0.2);
}

TEST(MachineProbe, FactorsAreScaledToWhatLoopsTook) {
    Profile profile;
    profile.factors = {{"a.b", 2}};
    // Of 3 s counted 2 are apart, and of 2.5 s measured half a second is left for loops.
    profile.rates = Rates({{"a.b 3d u8", {{.counted = 3, .apart = 2, .ratio = 2.5 / 3}}}});
    rebase_factors(profile);
    EXPECT_DOUBLE_EQ(profile.factor("a.b"), 0.5);
}

TEST(MachineProbe, WithoutRatesFactorsStay) {
    Profile profile;
    profile.factors = {{"a.b", 2}};
    rebase_factors(profile);
    EXPECT_EQ(profile.factor("a.b"), 2);
    EXPECT_EQ(profile.factor("unknown"), 1);
}

}  // namespace
}  // namespace edgewise::cli
