#include "runtime/kept_arena.hpp"

#include <algorithm>
#include <mutex>
#include <vector>

#include "runtime/flush_denormals.hpp"

namespace edgewise {

class KeptArenas {
 public:
    using Kept = KeptArena::Kept;

    static KeptArenas& all() {
        static auto* const arenas = new KeptArenas;  // workers may outlive static objects
        return *arenas;
    }

    std::unique_ptr<Kept> take(int threads) {
        {
            const std::lock_guard lock(mutex_);
            const auto found = std::find_if(free_.rbegin(), free_.rend(), [&](const auto& kept) {
                return kept->threads == threads;
            });
            if (found != free_.rend()) {
                std::unique_ptr<Kept> kept = std::move(*found);
                free_.erase(std::next(found).base());
                return kept;
            }
        }
        return std::make_unique<Kept>(threads);
    }

    void give_back(std::unique_ptr<Kept> kept) {
        std::unique_ptr<Kept> oldest;  // goes when the lock is gone
        const std::lock_guard lock(mutex_);
        free_.push_back(std::move(kept));
        if (free_.size() <= kMost) return;
        oldest = std::move(free_.front());
        free_.erase(free_.begin());
    }

 private:
    static constexpr std::size_t kMost = 8;
    KeptArenas() { free_.reserve(kMost + 1); }  // giving back never fails

    std::mutex mutex_;
    std::vector<std::unique_ptr<Kept>> free_;  // used last at the back
};

namespace {

/// An arena hands its workers the setting that it begins with.
tbb::task_arena& begun(tbb::task_arena& arena) {
    const FlushDenormals flushed;
    arena.initialize();
    return arena;
}

}  // namespace

KeptArena::Kept::Kept(int threads_of)
    : threads(threads_of), arena(threads_of), cores(begun(arena), threads_of) {}

KeptArena::KeptArena(int threads)
    : kept_(KeptArenas::all().take(threads)), at_work_(std::in_place, kept_->cores) {}

KeptArena::~KeptArena() {
    at_work_.reset();
    KeptArenas::all().give_back(std::move(kept_));
}

}  // namespace edgewise
