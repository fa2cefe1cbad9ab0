#include "runtime/one_thread_a_core.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <gtest/gtest.h>
#include <sched.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <thread>
#include <unistd.h>

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
        const OneThreadACore::AtWork run(spread);
        for (int i = 0; i < 10; ++i) meet(arena, before);
    }
    const cpu_set_t after = allowed();
    EXPECT_TRUE(CPU_EQUAL(&before, &after));
}

cpu_set_t allowed_to(pid_t thread) {
    cpu_set_t set;
    EXPECT_EQ(sched_getaffinity(thread, sizeof set, &set), 0);
    return set;
}

/// The worker that comes into an arena of two; 0: none.
pid_t worker_of(tbb::task_arena& arena) {
    std::atomic<pid_t> worker{0};
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    arena.execute([&] {
        const pid_t caller = gettid();
        tbb::parallel_for(
            0, 2,
            [&](int) {
                if (gettid() != caller) worker = gettid();
                while (worker == 0 && std::chrono::steady_clock::now() < limit)
                    std::this_thread::yield();
            },
            tbb::simple_partitioner());
    });
    return worker;
}

TEST(OneThreadACore, WhoIsInAnArenaThatNobodyObservesIsNotTakenForAwake) {
    const cpu_set_t before = allowed();
    if (CPU_COUNT(&before) < 2) GTEST_SKIP() << "one core only";
    tbb::task_arena arena(2), other(2);
    pid_t worker = 0;
    {
        const OneThreadACore spread(arena, 2);
        const OneThreadACore::AtWork run(spread);
        worker = worker_of(arena);
        ASSERT_NE(worker, 0);
    }
    // Still in the first arena, most likely: nobody will tell when it goes to sleep.
    const OneThreadACore spread(other, 2);
    const OneThreadACore::AtWork run(spread);
    const cpu_set_t bound = allowed_to(worker);
    EXPECT_EQ(CPU_COUNT(&bound), 1);
}

TEST(OneThreadACore, WorkersSleepBoundToACoreThatTheCallerHasNot) {
    const cpu_set_t before = allowed();
    if (CPU_COUNT(&before) < 2) GTEST_SKIP() << "one core only";
    tbb::task_arena arena(2);
    pid_t worker = 0;
    const auto is_bound_within = [&](std::chrono::seconds time) {
        const auto limit = std::chrono::steady_clock::now() + time;
        for (;;) {
            const cpu_set_t set = allowed_to(worker);
            if (CPU_COUNT(&set) == 1) return true;
            if (std::chrono::steady_clock::now() > limit) return false;
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    };
    {
        const OneThreadACore spread(arena, 2);
        const OneThreadACore::AtWork run(spread);
        worker = worker_of(arena);
        ASSERT_NE(worker, 0);
        EXPECT_TRUE(is_bound_within(std::chrono::seconds(5))) << "when it has gone to sleep";
    }
    const cpu_set_t after = allowed_to(worker);
    EXPECT_TRUE(CPU_EQUAL(&before, &after)) << "and free when nothing of ours runs";
    // The next one finds it asleep, on whichever core, and the caller on either.
    for (int core = 0; core < CPU_SETSIZE; ++core) {
        if (!CPU_ISSET(core, &before)) continue;
        cpu_set_t one;
        CPU_ZERO(&one);
        CPU_SET(core, &one);
        ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
        const OneThreadACore spread(arena, 2);
        const OneThreadACore::AtWork run(spread);
        const cpu_set_t bound = allowed_to(worker);
        EXPECT_EQ(CPU_COUNT(&bound), 1);
        EXPECT_FALSE(CPU_ISSET(core, &bound)) << "the caller is on core " << core;
        ASSERT_EQ(sched_setaffinity(0, sizeof before, &before), 0);
    }
    const cpu_set_t last = allowed_to(worker);
    EXPECT_TRUE(CPU_EQUAL(&before, &last));
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
        const OneThreadACore::AtWork run(spread);
        arena.execute([&] { tbb::parallel_for(0, 100, [](int) {}); });
    }
    const cpu_set_t after = allowed();
    EXPECT_TRUE(CPU_EQUAL(&one, &after)) << "it never leaves the cores that it may use";
    ASSERT_EQ(sched_setaffinity(0, sizeof before, &before), 0);
}

}  // namespace
}  // namespace edgewise
