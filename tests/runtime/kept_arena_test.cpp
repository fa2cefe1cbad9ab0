#include "runtime/kept_arena.hpp"

#include <atomic>
#include <gtest/gtest.h>
#include <limits>
#include <memory>
#include <tbb/parallel_for.h>
#include <thread>
#include <vector>

namespace edgewise {
namespace {

TEST(KeptArena, HasAsManyThreadsAsAreAskedFor) {
    Arenas arenas;
    for (const int threads : {1, 2, 3, 1, 2}) {
        KeptArena arena(arenas, threads);
        int most = 0;
        arena.execute([&] { most = tbb::this_task_arena::max_concurrency(); });
        EXPECT_EQ(most, threads);
    }
}

TEST(KeptArena, RunsAtTheSameTimeHaveArenasOfTheirOwn) {
    Arenas arenas;
    // The calling thread of each would be refused a place in a full arena, and wait.
    KeptArena outer(arenas, 1);
    int sum = 0;
    outer.execute([&] {
        KeptArena inner(arenas, 1);
        std::thread other([&] {
            KeptArena third(arenas, 1);
            third.execute([&] { ++sum; });
        });
        other.join();
        inner.execute([&] { ++sum; });
    });
    EXPECT_EQ(sum, 2);
    // More than are kept, all at once and then again.
    for (int round = 0; round < 2; ++round) {
        std::vector<std::unique_ptr<KeptArena>> many;
        for (int i = 0; i < 20; ++i) {
            many.push_back(std::make_unique<KeptArena>(arenas, 2));
            many.back()->execute([&] { tbb::parallel_for(0, 100, [](int) {}); });
        }
    }
}

#if defined(__SSE2__)
TEST(KeptArena, WorkersCountDenormalsAsZero) {
    Arenas arenas;
    const auto halved = [](float number) {
        volatile float read = number;  // at run time
        return read / 2;
    };
    const float least = std::numeric_limits<float>::min();
    for (int run = 0; run < 3; ++run) {
        KeptArena arena(arenas, 2);
        std::atomic<int> wrong{0}, by_workers{0};
        arena.execute([&] {
            const std::thread::id caller = std::this_thread::get_id();
            for (int round = 0; round < 1000 && by_workers == 0; ++round)
                tbb::parallel_for(0, 1000, [&](int) {
                    if (std::this_thread::get_id() == caller) return;
                    ++by_workers;
                    if (halved(least) != 0) ++wrong;
                });
        });
        EXPECT_EQ(wrong, 0);
    }
    EXPECT_NE(halved(least), 0) << "the caller's setting is its own";
}
#endif

}  // namespace
}  // namespace edgewise
