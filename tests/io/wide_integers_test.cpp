#include <cstdint>
#include <gtest/gtest.h>
#include <memory_resource>

#include "tests/io/store_testing.hpp"

namespace edgewise::store {
namespace {

using namespace testing;

template <class T>
std::string file_of(const std::vector<T>& numbers, const std::string& type) {
    const std::string head = "NRRD0004\ntype: " + type +
                             "\ndimension: 3\nsizes: " + std::to_string(numbers.size()) +
                             " 1 1\nendian: little\nencoding: raw\n\n";
    return head +
           std::string(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T));
}

template <class T>
Loaded loaded(const Scratch& scratch, const std::vector<T>& numbers, bool as_stored,
              const std::string& type = "int64") {
    Selection pick;
    pick.as_stored = as_stored;
    return load(scratch.put("a.nrrd", file_of(numbers, type)), pick,
                std::pmr::new_delete_resource());
}

// The first bytes of a file are enough to open it: what it holds is not looked at.
TEST(WideIntegers, OpeningLooksAtNoSample) {
    const Scratch scratch;
    const std::string path = scratch.put("a.nrrd", file_of<std::int64_t>({1, 2, 300}, "int64"));
    const Header header = inspect(path);
    EXPECT_EQ(header.integers, Wide::with_sign);
    EXPECT_EQ(header.type, Type::f64);
    EXPECT_TRUE(header.warnings.empty());
    // Other numbers in the same file: the description still fits.
    scratch.put("a.nrrd", file_of<std::int64_t>({-7, 1 << 20, 5}, "int64"));
    double samples[3];
    Selection pick;
    pick.as_stored = true;
    EXPECT_TRUE(read_samples(header, pick, samples, sizeof samples).empty());
    EXPECT_EQ(samples[0], -7);
    EXPECT_EQ(samples[1], 1 << 20);
}

TEST(WideIntegers, BecomeTheFirstTypeThatHoldsThemAll) {
    const Scratch scratch;
    struct Case {
        std::vector<std::int64_t> numbers;
        Type type;
    };
    const std::vector<Case> cases{{{0, 255, 3}, Type::u8},         {{-1, 127, 3}, Type::i8},
                                  {{-1, 128, 3}, Type::i16},       {{0, 40000, 3}, Type::u16},
                                  {{-1, 40000, 3}, Type::i32},     {{0, 4000000000, 3}, Type::u32},
                                  {{-1, 4000000000, 3}, Type::f64}};
    for (const Case& one : cases) {
        const Loaded as_stored = loaded(scratch, one.numbers, true);
        EXPECT_EQ(as_stored.header.type, one.type);
        EXPECT_EQ(as_stored.header.integers, Wide::no);
        ASSERT_EQ(as_stored.samples.bytes(), 3 * bytes_of(one.type));
        const Loaded computed = loaded(scratch, one.numbers, false);
        // Types of 32 bits and more are computed in f32.
        EXPECT_EQ(computed.header.type, bytes_of(one.type) < 4 ? one.type : Type::f32);
        ASSERT_EQ(computed.samples.bytes(), 3 * bytes_of(computed.header.type));
    }
    const Loaded small = loaded<std::int64_t>(scratch, {-3, 200, 7}, false);
    const auto* values = static_cast<const std::int16_t*>(small.samples.data());
    EXPECT_EQ(std::vector<int>(values, values + 3), (std::vector<int>{-3, 200, 7}));
    const Loaded unsigned_ones =
        loaded<std::uint64_t>(scratch, {1, 2, 4294967295u}, true, "uint64");
    EXPECT_EQ(unsigned_ones.header.type, Type::u32);
}

TEST(WideIntegers, RoundedOnesAreCountedAndBitsKept) {
    const Scratch scratch;
    const std::int64_t large = (std::int64_t{1} << 53) + 1;
    const Loaded found = loaded<std::int64_t>(scratch, {large, 5, large + 2}, true);
    ASSERT_FALSE(found.header.warnings.empty());
    EXPECT_NE(found.header.warnings[0].text().find("2 of its 64-bit integers"), std::string::npos);
    const Header header = inspect(scratch.path("a.nrrd"));
    std::int64_t samples[3];
    Selection pick;
    pick.as_stored = pick.bits64 = true;
    EXPECT_TRUE(read_samples(header, pick, samples, sizeof samples).empty());
    EXPECT_EQ((std::vector<std::int64_t>{samples[0], samples[1], samples[2]}),
              (std::vector<std::int64_t>{large, 5, large + 2}));
}

}  // namespace
}  // namespace edgewise::store
