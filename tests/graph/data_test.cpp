// Samples of a caller, and what stands for their last rows.
#include "graph/data.hpp"

#include <cstdint>
#include <cstring>
#include <gtest/gtest.h>
#include <memory_resource>
#include <vector>

namespace edgewise {
namespace {

/// Counts what is taken and not given back.
class Counted : public std::pmr::memory_resource {
 public:
    std::size_t used() const { return used_; }

 private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override {
        used_ += bytes;
        return std::pmr::new_delete_resource()->allocate(bytes, alignment);
    }
    void do_deallocate(void* at, std::size_t bytes, std::size_t alignment) override {
        used_ -= bytes;
        std::pmr::new_delete_resource()->deallocate(at, bytes, alignment);
    }
    bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
        return this == &other;
    }
    std::size_t used_ = 0;
};

/// Numbers of a caller that count up.
template <class T>
struct Counting {
    std::shared_ptr<std::vector<T>> numbers;
    Data data;

    Counting(const Extent& extent, Type type, int channels = 1) {
        data.what.extent = extent;
        data.what.type = type;
        data.what.channels = channels;
        numbers = std::make_shared<std::vector<T>>(extent.samples() * channels);
        for (std::size_t i = 0; i < numbers->size(); ++i) (*numbers)[i] = static_cast<T>(i);
        data.samples = Array::around(numbers->data(), numbers->size() * sizeof(T), numbers);
    }
};

/// @param rows  that are copied
template <class T>
void expect_tail(const Counting<T>& of, std::int64_t rows) {
    Counted memory;
    const Data with = with_slack(of.data, &memory);
    EXPECT_EQ(with.samples.data(), of.numbers->data()) << "shared";
    const auto count = static_cast<std::size_t>(rows * of.data.row());
    ASSERT_EQ(with.tail.bytes(), count * sizeof(T));
    EXPECT_TRUE(with.tail.has_slack());
    EXPECT_EQ(0, std::memcmp(with.tail.data(), of.numbers->data() + of.numbers->size() - count,
                             count * sizeof(T)));
    EXPECT_EQ(memory.used(), count * sizeof(T) + kArraySlack) << "counted";
    // Vectors that begin in another row end with the samples.
    EXPECT_GE(count * sizeof(T), kArraySlack);
    EXPECT_LT((rows - 1) * of.data.row() * static_cast<std::int64_t>(sizeof(T)),
              static_cast<std::int64_t>(kArraySlack));
}

TEST(WithSlack, LastRowsOfACallersAreCopied) {
    expect_tail(Counting<std::uint8_t>({7, 9, 5}, Type::u8), 10);
    expect_tail(Counting<std::uint8_t>({64, 3, 1}, Type::u8), 1);
    expect_tail(Counting<std::uint8_t>({63, 3, 2}, Type::u8), 2);
    expect_tail(Counting<std::int16_t>({5, 5, 5}, Type::i16, 3), 3);
    expect_tail(Counting<float>({100, 4, 2}, Type::f32), 1);
}

TEST(WithSlack, FewSamplesAreCopied) {
    for (const Extent& extent : {Extent{1, 1, 1}, {7, 5, 1}, {300, 1, 1}}) {
        const Counting<std::uint8_t> of(extent, Type::u8);
        Counted memory;
        const Data with = with_slack(of.data, &memory);
        EXPECT_TRUE(with.samples.has_slack());
        EXPECT_EQ(with.tail.bytes(), 0u);
        EXPECT_EQ(with.samples.bytes(), of.numbers->size());
        EXPECT_EQ(0, std::memcmp(with.samples.data(), of.numbers->data(), of.numbers->size()));
    }
}

TEST(WithSlack, WhatHasSlackIsShared) {
    Counted memory;
    Representation what;
    what.extent = {20, 20, 4};
    const Data own = Data::make(what, &memory);
    const std::size_t before = memory.used();
    EXPECT_EQ(with_slack(own, &memory).samples.data(), own.samples.data());
    const Counting<float> of({40, 9, 2}, Type::f32);
    const Data once = with_slack(of.data, &memory);
    const Data twice = with_slack(once, &memory);
    EXPECT_EQ(twice.tail.data(), once.tail.data());
    EXPECT_EQ(memory.used(), before + once.tail.bytes() + kArraySlack);
}

TEST(WithSlack, ABoxEndsWithItsOwnLastRow) {
    Counting<std::uint8_t> of({70, 4, 3}, Type::u8);
    of.data.what.extent = {200, 10, 9};
    of.data.box = {{100, 2, 3}, {170, 6, 6}};
    expect_tail(of, 1);
}

}  // namespace
}  // namespace edgewise
