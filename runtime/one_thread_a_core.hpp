#pragma once

#include <atomic>
#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>
#include <vector>

namespace edgewise {

/// Threads of an arena run on cores of their own. A worker that has slept is often woken on the
/// core of the thread that woke it (always, where a virtual machine reports its idle cores as taken
/// away), waits there until that thread's slice ends, and is parted from it only after some
/// milliseconds: two threads are then no faster than one. So workers sleep bound to a core that no
/// other thread of the arena has, and are free as soon as they are awake. One that comes to a taken
/// core nevertheless moves to a free one. Affinities are as before while threads work, and when
/// nothing is at work any more. Does nothing where there are more threads than cores, and on
/// systems without Linux's affinity calls.
class OneThreadACore final : public tbb::task_scheduler_observer {
 public:
    /// `arena` outlives it, and no thread works in it when it goes.
    OneThreadACore(tbb::task_arena& arena, int threads);
    ~OneThreadACore() override;

    /// From now on, until it goes, the arena is at work. The calling thread is the one that enters
    /// it first. Workers that have not yet left it, after work before, are left alone.
    class AtWork {
     public:
        explicit AtWork(const OneThreadACore& cores);
        ~AtWork();
        AtWork(const AtWork&) = delete;
        AtWork& operator=(const AtWork&) = delete;

     private:
        bool begun_ = false;
    };

    void on_scheduler_entry(bool worker) override;
    void on_scheduler_exit(bool worker) override;

 private:
    std::vector<std::atomic<int>> core_;  // of the thread in each slot of the arena; -1: none
};

}  // namespace edgewise
