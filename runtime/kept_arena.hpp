#pragma once

#include <memory>
#include <optional>
#include <tbb/task_arena.h>

#include "runtime/one_thread_a_core.hpp"

namespace edgewise {

/// A task arena of so many threads for one run, whose threads run on cores of their own and count
/// denormals as zero. The process keeps such arenas, and what was left last comes first: a worker
/// stays where it worked for a tenth of a millisecond or more, and to call it from there into a new
/// arena takes 0.05 to 0.1 ms, as much as a small picture. Runs at the same time have arenas of
/// their own.
class KeptArena {
 public:
    explicit KeptArena(int threads);
    ~KeptArena();
    KeptArena(const KeptArena&) = delete;
    KeptArena& operator=(const KeptArena&) = delete;

    /// In the calling thread, which becomes one of the arena's.
    template <class Body>
    void execute(const Body& body) {
        kept_->arena.execute(body);
    }

 private:
    friend class KeptArenas;
    struct Kept {
        explicit Kept(int threads_of);
        int threads;
        tbb::task_arena arena;
        OneThreadACore cores;
    };
    std::unique_ptr<Kept> kept_;
    std::optional<OneThreadACore::AtWork> at_work_;
};

}  // namespace edgewise
