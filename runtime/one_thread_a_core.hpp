#pragma once

#include <atomic>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>
#include <vector>

namespace edgewise {

/// Threads that enter an arena begin on cores of their own. A worker that has slept is often woken
/// on the core of the thread that woke it, and the system's balancing takes longer than many of
/// our runs to part them: two threads are then no faster than one. A thread that finds its core
/// taken by another of the arena moves to a free one; its affinity is as before afterwards, so
/// that the system may still move it. Does nothing where there are more threads than cores, and
/// on systems without Linux's affinity calls.
///
/// On a machine with two cores (benchmarks/waking.cpp) loops of 4 and 8 ms of work take 0.8 and
/// 0.6 times as long with it after workers have slept for 20 or 200 ms. Shorter loops end before
/// the second thread has come, longer ones the system parts in time, and after 5 ms of sleep it
/// brings at most 6 %.
class OneThreadACore final : public tbb::task_scheduler_observer {
 public:
    /// From now on, until it goes. `arena` outlives it, and no thread works in it when it goes.
    OneThreadACore(tbb::task_arena& arena, int threads);
    ~OneThreadACore() override { observe(false); }

    void on_scheduler_entry(bool worker) override;
    void on_scheduler_exit(bool worker) override;

 private:
    std::vector<std::atomic<bool>> taken_;  // by number of the core
    std::vector<std::atomic<int>> core_;    // of the thread in each slot of the arena; -1: none
};

}  // namespace edgewise
