#include "runtime/one_thread_a_core.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <gtest/gtest.h>
#include <sched.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <thread>

namespace edgewise {
namespace {

cpu_set_t allowed() {
    cpu_set_t set;
    EXPECT_EQ(sched_getaffinity(0, sizeof set, &set), 0);
    return set;
}

/// Both threads of an arena are in it at once. @return the cores that they run on then
std::pair<int, int> meet(tbb::task_arena& arena, const cpu_set_t& expected) {
    std::atomic<int> here{0};
    std::array<int, 2> cores{-1, -1};
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    arena.execute([&] {
        tbb::parallel_for(
            0, 2,
            [&](int i) {
                cores[std::size_t(i)] = sched_getcpu();
                const cpu_set_t mask = allowed();
                EXPECT_TRUE(CPU_EQUAL(&mask, &expected)) << "a thread stays free to be moved";
                ++here;
                while (here < 2 && std::chrono::steady_clock::now() < limit)
                    std::this_thread::yield();
            },
            tbb::simple_partitioner());
    });
    return {cores[0], cores[1]};
}

TEST(OneThreadACore, LeavesThreadsFreeAndTheCallerWhereItIs) {
    const cpu_set_t before = allowed();
    tbb::task_arena arena(2);
    {
        const OneThreadACore spread(arena, 2);
        for (int i = 0; i < 10; ++i) meet(arena, before);
    }
    const cpu_set_t after = allowed();
    EXPECT_TRUE(CPU_EQUAL(&before, &after));
}

TEST(OneThreadACore, StaysOnTheOneCoreThatIsAllowed) {
    const cpu_set_t before = allowed();
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(sched_getcpu(), &one);
    ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
    {
        tbb::task_arena arena(2);
        const OneThreadACore spread(arena, 2);
        arena.execute([&] { tbb::parallel_for(0, 100, [](int) {}); });
    }
    const cpu_set_t after = allowed();
    EXPECT_TRUE(CPU_EQUAL(&one, &after)) << "it never leaves the cores that it may use";
    ASSERT_EQ(sched_setaffinity(0, sizeof before, &before), 0);
}

}  // namespace
}  // namespace edgewise
