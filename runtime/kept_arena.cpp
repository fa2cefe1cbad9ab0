#include "runtime/kept_arena.hpp"

#include <algorithm>
#include <mutex>
#include <vector>

#include "runtime/flush_denormals.hpp"

namespace edgewise {
namespace {

constexpr std::size_t kMost = 8;  // arenas that wait

/// An arena hands its workers the setting that it begins with.
tbb::task_arena& begun(tbb::task_arena& arena) {
    const FlushDenormals flushed;
    arena.initialize();
    return arena;
}

}  // namespace

struct Arenas::Kept {
    explicit Kept(int threads_of)
        : threads(threads_of), arena(threads_of), cores(begun(arena), threads_of) {}

    int threads;
    tbb::task_arena arena;
    OneThreadACore cores;
};

struct Arenas::Free {
    Free() { waiting.reserve(kMost + 1); }  // giving back never fails

    /// One of so many threads that nobody uses, or null.
    std::unique_ptr<Kept> take(int threads) {
        const std::lock_guard lock(mutex);
        const auto found = std::find_if(waiting.rbegin(), waiting.rend(),
                                        [&](const auto& kept) { return kept->threads == threads; });
        if (found == waiting.rend()) return nullptr;
        std::unique_ptr<Kept> kept = std::move(*found);
        waiting.erase(std::next(found).base());
        return kept;
    }
    /// What those that are gone left for others. An arena that ends while a worker is on its way
    /// out of it loses some bytes of its observer (oneTBB 2021.8).
    static Free& left() {
        static auto* const left = new Free;
        return *left;
    }

    std::mutex mutex;
    std::vector<std::unique_ptr<Kept>> waiting;  // used last at the back
};

Arenas::Arenas() : free_(std::make_unique<Free>()) {}
Arenas::~Arenas() {
    Free& left = Free::left();
    const std::lock_guard lock(left.mutex);
    for (std::unique_ptr<Kept>& kept : free_->waiting) left.waiting.push_back(std::move(kept));
}

KeptArena::KeptArena(Arenas& from, int threads) : from_(from), kept_(from.free_->take(threads)) {
    if (!kept_) kept_ = Arenas::Free::left().take(threads);
    if (!kept_) kept_ = std::make_unique<Arenas::Kept>(threads);
    at_work_.emplace(kept_->cores);
}

KeptArena::~KeptArena() {
    at_work_.reset();
    std::unique_ptr<Arenas::Kept> oldest;  // goes when the lock is gone
    const std::lock_guard lock(from_.free_->mutex);
    auto& waiting = from_.free_->waiting;
    waiting.push_back(std::move(kept_));
    if (waiting.size() <= kMost) return;
    oldest = std::move(waiting.front());
    waiting.erase(waiting.begin());
}

tbb::task_arena& KeptArena::arena() noexcept { return kept_->arena; }

}  // namespace edgewise
