#include "runtime/memory_budget.hpp"

#include <cstdint>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <thread>
#include <vector>

#include "graph/data.hpp"

namespace edgewise {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;

TEST(MemoryBudget, CountsAndRefuses) {
    MemoryBudget memory(1000);
    EXPECT_EQ(memory.limit(), 1000u);
    void* a = memory.allocate(600, 64);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(a) % 64, 0u);
    EXPECT_EQ(memory.used(), 600u);
    EXPECT_THROW((void)memory.allocate(401, 64), std::bad_alloc);
    void* b = memory.allocate(400, 64);  // the limit itself is allowed
    EXPECT_EQ(memory.used(), 1000u);
    memory.deallocate(a, 600, 64);
    memory.deallocate(b, 400, 64);
    EXPECT_EQ(memory.used(), 0u);
    EXPECT_EQ(memory.peak(), 1000u);
}

TEST(MemoryBudget, LargeBlocksBeginAtHugePages) {
    MemoryBudget memory(100 * kMiB);
    // Odd sizes one after the other: what the system maps next lies anywhere.
    for (const std::size_t bytes : {2 * kMiB, 2 * kMiB + 4097, 5 * kMiB + 1, 9 * kMiB}) {
        void* block = memory.allocate(bytes, 64);
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(block) % (2 * kMiB), 0u) << bytes;
        std::memset(block, 1, bytes);  // all of it is there
        memory.deallocate(block, bytes, 64);
    }
}

TEST(MemoryBudget, RefusalLeavesNoTrace) {
    MemoryBudget memory(10 * kMiB);
    for (const std::size_t bytes :
         {10 * kMiB + 1, 100 * kMiB, std::numeric_limits<std::size_t>::max(),
          std::numeric_limits<std::size_t>::max() - 4095})
        EXPECT_THROW((void)memory.allocate(bytes, 64), std::bad_alloc) << bytes;
    EXPECT_EQ(memory.used(), 0u);
    EXPECT_EQ(memory.peak(), 0u);
    void* all = memory.allocate(10 * kMiB, 64);
    memory.deallocate(all, 10 * kMiB, 64);
}

TEST(MemoryBudget, LargeBlocksAreReusedAndGivenBackWhenOthersNeedTheRoom) {
    MemoryBudget memory(10 * kMiB);
    void* first = memory.allocate(4 * kMiB, 64);
    std::memset(first, 1, 4 * kMiB);
    memory.deallocate(first, 4 * kMiB, 64);
    EXPECT_EQ(memory.used(), 0u);
    void* again = memory.allocate(4 * kMiB, 64);
    EXPECT_EQ(again, first);
    memory.deallocate(again, 4 * kMiB, 64);
    void* larger = memory.allocate(9 * kMiB, 64);  // the kept 4 MiB must make way
    EXPECT_LE(memory.peak(), memory.limit());
    std::memset(larger, 1, 9 * kMiB);
    memory.deallocate(larger, 9 * kMiB, 64);
    memory.trim();
    void* all = memory.allocate(10 * kMiB, 64);
    memory.deallocate(all, 10 * kMiB, 64);
    EXPECT_EQ(memory.peak(), 10 * kMiB);
}

TEST(MemoryBudget, BlocksOfEverNewSizesDoNotPileUp) {
    MemoryBudget memory(100 * kMiB);
    void* held = memory.allocate(8 * kMiB, 64);
    std::size_t largest = 0;
    for (std::size_t i = 1; i <= 40; ++i) {
        largest = kMiB + i * 4096;
        memory.deallocate(memory.allocate(largest, 64), largest, 64);
        EXPECT_EQ(memory.peak(), 8 * kMiB + largest);
    }
    memory.deallocate(held, 8 * kMiB, 64);
    // There is room below the peak again: one of them and the first block are still kept.
    void* small = memory.allocate(largest, 64);
    void* again = memory.allocate(8 * kMiB, 64);
    EXPECT_EQ(again, held);
    EXPECT_EQ(memory.peak(), 8 * kMiB + largest);
    memory.deallocate(small, largest, 64);
    memory.deallocate(again, 8 * kMiB, 64);
}

/// Asks for blocks of these sizes, one after the other, as steps of a path do with scratch.
/// @return how many of them were mapped anew: those that are still clear
int run_of_blocks(MemoryBudget& memory, const std::vector<std::size_t>& sizes) {
    int mapped = 0;
    for (const std::size_t bytes : sizes) {
        auto* block = static_cast<char*>(memory.allocate(bytes, 64));
        mapped += *block == 0;
        *block = 1;
        memory.deallocate(block, bytes, 64);
    }
    return mapped;
}

TEST(MemoryBudget, SmallBlocksOfThisPathStayAndLargeOnesOfAnotherGo) {
    MemoryBudget memory(100 * kMiB);
    const std::vector<std::size_t> large = {30 * kMiB, 20 * kMiB};
    EXPECT_EQ(run_of_blocks(memory, large), 2);
    EXPECT_EQ(memory.peak(), 30 * kMiB);  // the second did not add to it
    const std::vector<std::size_t> small = {4 * kMiB, 7 * kMiB};
    EXPECT_EQ(run_of_blocks(memory, small), 2);
    for (int run = 0; run < 3; ++run) EXPECT_EQ(run_of_blocks(memory, small), 0) << run;
    EXPECT_EQ(memory.peak(), 30 * kMiB);
}

/// Under AddressSanitizer small blocks go at once.
#if !defined(__SANITIZE_ADDRESS__)
TEST(MemoryBudget, SmallBlocksAreReused) {
    MemoryBudget memory(kMiB);
    for (const std::size_t bytes : {1u, 64u, 65u, 100u, 4096u, 40000u, 65535u}) {
        void* first = memory.allocate(bytes, 64);
        std::memset(first, 1, bytes);
        EXPECT_EQ(memory.used(), bytes) << "what was asked for is counted";
        memory.deallocate(first, bytes, 64);
        EXPECT_EQ(memory.used(), 0u);
        void* again = memory.allocate(bytes, 16);
        EXPECT_EQ(again, first) << bytes;
        memory.deallocate(again, bytes, 16);
    }
    void* wide = memory.allocate(100, 256);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(wide) % 256, 0u);
    memory.deallocate(wide, 100, 256);
    EXPECT_EQ(memory.peak(), 65535u);
}
#endif

TEST(MemoryBudget, SmallBlocksOfAllSizesKeepApart) {
    MemoryBudget memory(64 * kMiB);
    std::mt19937 random(5);
    struct Held {
        unsigned char* block;
        std::size_t bytes;
        unsigned char value;
    };
    std::vector<Held> held;
    std::size_t used = 0;
    for (int i = 0; i < 20000; ++i) {
        if (held.size() < 100 || random() % 2) {
            const std::size_t bytes = 1 + random() % (random() % 4 ? 3000 : 66000);
            auto* block = static_cast<unsigned char*>(memory.allocate(bytes, 64));
            const auto value = static_cast<unsigned char>(random());
            std::memset(block, value, bytes);
            held.push_back({block, bytes, value});
            used += bytes < 65536 ? bytes : (bytes + 4095) / 4096 * 4096;
        } else {
            std::swap(held[random() % held.size()], held.back());
            const Held gone = held.back();
            held.pop_back();
            ASSERT_EQ(gone.block[0], gone.value);
            ASSERT_EQ(gone.block[gone.bytes / 2], gone.value);
            ASSERT_EQ(gone.block[gone.bytes - 1], gone.value);
            used -= gone.bytes < 65536 ? gone.bytes : (gone.bytes + 4095) / 4096 * 4096;
            memory.deallocate(gone.block, gone.bytes, 64);
        }
        ASSERT_EQ(memory.used(), used);
    }
    for (const Held& each : held) memory.deallocate(each.block, each.bytes, 64);
    EXPECT_EQ(memory.used(), 0u);
}

TEST(MemoryBudget, WhatIsGivenAwayCountsNoMore) {
    MemoryBudget memory(kMiB);
    for (const std::size_t bytes : {std::size_t{1000}, kMiB - 5000}) {
        void* block = memory.allocate(bytes, 64);
        void* other = memory.allocate(2000, 64);
        EXPECT_GE(memory.used(), bytes + 2000);
        memory.give_away(block, bytes);
        memory.give_away(block, bytes);  // nothing more
        EXPECT_EQ(memory.used(), 2000u);
        // There is room for as much again.
        void* more = memory.allocate(bytes, 64);
        std::memset(block, 1, bytes);
        std::memset(more, 2, bytes);
        EXPECT_EQ(static_cast<char*>(block)[bytes - 1], 1);
        memory.deallocate(block, bytes, 64);
        EXPECT_GE(memory.used(), bytes + 2000) << "it is not taken off twice";
        memory.deallocate(more, bytes, 64);
        memory.deallocate(other, 2000, 64);
        EXPECT_EQ(memory.used(), 0u);
    }
}

TEST(MemoryBudget, NeverExceedsItsLimitUnderManyThreads) {
    MemoryBudget memory(8 * kMiB);
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            std::mt19937 random(t);
            for (int i = 0; i < 500; ++i) {
                const bool large = i % 5 == 0;
                const std::size_t bytes =
                    large ? kMiB + random() % (3 * kMiB) : 1 + random() % 100000;
                try {
                    Array array(bytes, &memory);
                    std::memset(array.data(), t, array.bytes() + kArraySlack);
                    if (i % 7 == 0) std::this_thread::yield();
                    const auto* last = static_cast<char*>(array.data()) + bytes + kArraySlack - 1;
                    EXPECT_EQ(*last, t) << "two threads share a block";
                } catch (const std::bad_alloc&) {
                }
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(memory.used(), 0u);
    EXPECT_LE(memory.peak(), memory.limit());
    EXPECT_GT(memory.peak(), 0u);
}

TEST(Array, MovesAndIsAligned) {
    MemoryBudget memory(kMiB);
    Array a(100, &memory);
    EXPECT_EQ(memory.used(), 100 + kArraySlack);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(a.data()) % 64, 0u);
    void* data = a.data();
    Array b(std::move(a));
    EXPECT_EQ(b.data(), data);
    Array c(10, &memory);
    c = std::move(b);
    EXPECT_EQ(c.data(), data);
    EXPECT_EQ(c.bytes(), 100u);
    EXPECT_EQ(memory.used(), 100 + kArraySlack);  // what c held before is gone
    c = Array();
    EXPECT_EQ(memory.used(), 0u);
}

}  // namespace
}  // namespace edgewise
