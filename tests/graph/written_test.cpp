#include "graph/written.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

namespace edgewise {
namespace {

TEST(Written, IntegersAreTheNearestAndTheEven) {
    EXPECT_EQ(stored_as<std::uint8_t>(0.5), 0);
    EXPECT_EQ(stored_as<std::uint8_t>(1.5), 2);
    EXPECT_EQ(stored_as<std::int16_t>(-2.5), -2);
    EXPECT_EQ(stored_as<std::int16_t>(-2.51), -3);
    EXPECT_EQ(stored_as<std::uint8_t>(300), 255);
    EXPECT_EQ(stored_as<std::int8_t>(-1e30), -128);
    EXPECT_EQ(stored_as<std::uint32_t>(4294967295.0), 4294967295u);
    EXPECT_EQ(stored_as<std::int32_t>(-2147483648.0), std::numeric_limits<std::int32_t>::min());
    EXPECT_EQ(stored_as<std::uint8_t>(NAN), 0);
    EXPECT_EQ(stored_as<std::uint8_t>(INFINITY), 255);
}

TEST(Written, TellsWhatATypeCanStore) {
    EXPECT_TRUE(can_store(Type::u8, {}, 255));
    EXPECT_FALSE(can_store(Type::u8, {}, 256));
    EXPECT_FALSE(can_store(Type::u8, {}, 0.5));
    EXPECT_TRUE(can_store(Type::u8, {.slope = 0.5}, 0.5));
    EXPECT_TRUE(can_store(Type::i16, {.slope = 1, .offset = -1024}, -1024));
    EXPECT_FALSE(can_store(Type::u16, {.slope = 1, .offset = 10}, 9));
    EXPECT_TRUE(can_store(Type::f16, {}, 0.5));
    EXPECT_FALSE(can_store(Type::f16, {}, 2049));
    EXPECT_TRUE(can_store(Type::f32, {}, 0.1));
    EXPECT_FALSE(can_store(Type::f32, {}, NAN));
    EXPECT_FALSE(can_store(Type::c64, {}, 0));
}

/// Each half is the nearest to itself; between two, the middle goes to the even one.
TEST(Written, HalvesAreTheNearestAndTheEven) {
    for (std::uint32_t bits = 0; bits < 0x7c00; ++bits) {
        const Half here{static_cast<std::uint16_t>(bits)};
        const float value = float_of(here);
        // IEEE 754: 2^-24 m below 2^-14, else 2^(e - 15) (1 + m / 1024).
        const int exponent = static_cast<int>(bits >> 10), fraction = static_cast<int>(bits & 1023);
        const double expected =
            exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024 + fraction, exponent - 25);
        ASSERT_EQ(value, expected) << bits;
        ASSERT_EQ(half_of(value).bits, bits);
        ASSERT_EQ(half_of(-value).bits, bits | 0x8000);
        if (bits == 0x7bff) continue;
        const float next = float_of(Half{static_cast<std::uint16_t>(bits + 1)});
        const float middle = (value + next) / 2;  // exact: f32 has 13 more digits
        ASSERT_EQ(half_of(middle).bits, bits % 2 ? bits + 1 : bits);
        ASSERT_EQ(half_of(std::nextafter(middle, 0.0f)).bits, bits);
        ASSERT_EQ(half_of(std::nextafter(middle, 1e9f)).bits, bits + 1);
    }
    EXPECT_EQ(half_of(65520).bits, 0x7c00);
    EXPECT_EQ(half_of(65519).bits, 0x7bff);
    EXPECT_TRUE(std::isnan(float_of(half_of(NAN))));
}

TEST(Written, AFileSaysWhatItsTypeCan) {
    std::vector<double> values{0.4, 7.5, -3, 900};
    round_as({.type = Type::u8}, values);
    EXPECT_EQ(values, (std::vector<double>{0, 8, 0, 255}));
    values = {-1000.2, 24.3};
    round_as({.type = Type::i16, .values = {0.5, -1000}}, values);
    EXPECT_EQ(values, (std::vector<double>{-1000, 24.5}));
    values = {0.1, 1e30};
    round_as({.type = Type::f32}, values);
    EXPECT_EQ(values, (std::vector<double>{0.1f, 1e30f}));
    values = {1 + 0x1p-12};
    round_as({.type = Type::f16}, values);
    EXPECT_EQ(values[0], 1);
}

/// In memory colour is multiplied by alpha, in the file it is not.
TEST(Written, StraightColourIsRoundedAsItIsStored) {
    const WrittenAs how{.type = Type::u8, .straight = true, .opaque = 255};
    std::vector<double> values{0.5 * 100.4, 0.5};  // grey 100.4, half opaque
    round_as(how, values);
    EXPECT_DOUBLE_EQ(values[1], 128.0 / 255);  // 127.5 goes to the even number
    EXPECT_DOUBLE_EQ(values[0], 100 * (128.0 / 255));
    values = {12, 0};
    round_as(how, values);
    EXPECT_EQ(values, (std::vector<double>{0, 0}));
}

}  // namespace
}  // namespace edgewise
