#pragma once

#include <memory>
#include <optional>
#include <tbb/task_arena.h>

#include "runtime/one_thread_a_core.hpp"

namespace edgewise {

class KeptArena;

/// Task arenas that ended runs left for those to come. What was left last comes first: a worker
/// stays where it worked for a tenth of a millisecond or more, and to call it from there into a new
/// arena takes 0.05 to 0.1 ms, as much as a small picture. Threads share it.
class Arenas {
 public:
    Arenas();
    ~Arenas();
    Arenas(const Arenas&) = delete;
    Arenas& operator=(const Arenas&) = delete;

 private:
    friend class KeptArena;
    struct Kept;
    struct Free;
    std::unique_ptr<Free> free_;
};

/// A task arena of so many threads for one run, whose threads run on cores of their own and count
/// denormals as zero. Runs at the same time have arenas of their own.
class KeptArena {
 public:
    /// Taken from those that are kept, and given back to them.
    KeptArena(Arenas& from, int threads);
    ~KeptArena();
    KeptArena(const KeptArena&) = delete;
    KeptArena& operator=(const KeptArena&) = delete;

    /// In the calling thread, which becomes one of the arena's.
    template <class Body>
    void execute(const Body& body) {
        arena().execute(body);
    }

 private:
    tbb::task_arena& arena() noexcept;

    Arenas& from_;
    std::unique_ptr<Arenas::Kept> kept_;
    std::optional<OneThreadACore::AtWork> at_work_;
};

}  // namespace edgewise
