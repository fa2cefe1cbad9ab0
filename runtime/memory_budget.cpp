#include "runtime/memory_budget.hpp"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <iterator>
#include <mutex>
#include <new>
#include <sys/mman.h>

namespace edgewise {
namespace {

/// From here on blocks are mapped and kept, not malloced: malloc gives scratch of this size back to
/// the system at once, and each tile would touch all of its pages anew.
constexpr std::size_t kMapped = std::size_t{1} << 16;
constexpr std::size_t kHugePage = std::size_t{2} << 20;
constexpr std::size_t kPage = 4096;

std::size_t mapped_size(std::size_t bytes) { return (bytes + kPage - 1) / kPage * kPage; }

/// Blocks of a huge page and more begin at the boundary of one: a read at a computed address misses
/// the TLB of small pages nearly always, and how many huge ones a block had would be left to
/// chance.
void* map_block(std::size_t bytes) {
    const std::size_t slack = bytes >= kHugePage ? kHugePage - kPage : 0;
    void* mapped =
        mmap(nullptr, bytes + slack, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (mapped == MAP_FAILED) throw std::bad_alloc();
    if (slack == 0) return mapped;
    char* const begin = static_cast<char*>(mapped);
    const std::size_t before =
        (kHugePage - reinterpret_cast<std::uintptr_t>(begin) % kHugePage) % kHugePage;
    if (before > 0) munmap(begin, before);
    if (before < slack) munmap(begin + before + bytes, slack - before);
    madvise(begin + before, bytes, MADV_HUGEPAGE);  // a wish, not a need
    return begin + before;
}

}  // namespace

struct MemoryBudget::State {
    struct Spare {
        std::size_t bytes;
        void* block;
    };
    std::mutex mutex;
    std::size_t limit = 0, used = 0, kept = 0, peak = 0;
    std::deque<Spare> spare;  // mapped blocks that wait for reuse; the last released is last

    void drop_spare() {
        while (!spare.empty()) drop_one();
    }
    /// Frees the least recently used block: blocks of an earlier path may be larger than all that
    /// a frame of this path needs.
    void drop_one() {
        munmap(spare.front().block, spare.front().bytes);
        kept -= spare.front().bytes;
        spare.pop_front();
    }
    /// @return a block of just these bytes, or null
    void* take_spare(std::size_t bytes) {
        const auto last = std::find_if(spare.rbegin(), spare.rend(),
                                       [&](const Spare& each) { return each.bytes == bytes; });
        if (last == spare.rend()) return nullptr;
        void* block = last->block;
        spare.erase(std::next(last).base());
        kept -= bytes;
        used += bytes;
        return block;
    }
    /// Counts bytes, or throws; the caller holds the mutex. What is kept for reuse hardly adds to
    /// the peak: blocks of ever new sizes would pile up. That little keeps a small block from
    /// driving a large one out, which the next frame would have to map again.
    void count(std::size_t bytes) {
        if (bytes > limit || used > limit - bytes) throw std::bad_alloc();
        used += bytes;
        peak = std::max(peak, used);
        const std::size_t most = std::min(limit, peak + peak / 32);
        while (!spare.empty() && used + kept > most) drop_one();
    }
};

MemoryBudget::MemoryBudget(std::size_t limit) : state_(std::make_unique<State>()) {
    state_->limit = limit;
}
MemoryBudget::~MemoryBudget() { state_->drop_spare(); }

std::size_t MemoryBudget::used() const noexcept {
    const std::lock_guard lock(state_->mutex);
    return state_->used;
}
std::size_t MemoryBudget::peak() const noexcept {
    const std::lock_guard lock(state_->mutex);
    return state_->peak;
}
void MemoryBudget::reset_peak() noexcept {
    const std::lock_guard lock(state_->mutex);
    state_->peak = state_->used + state_->kept;
}
std::size_t MemoryBudget::limit() const noexcept { return state_->limit; }

void MemoryBudget::trim() noexcept {
    const std::lock_guard lock(state_->mutex);
    state_->drop_spare();
}

void* MemoryBudget::do_allocate(std::size_t bytes, std::size_t alignment) {
    const std::lock_guard lock(state_->mutex);
    if (bytes < kMapped) {
        state_->count(bytes);
        void* block = ::operator new(bytes, std::align_val_t(alignment), std::nothrow);
        if (!block) {
            state_->used -= bytes;
            throw std::bad_alloc();
        }
        return block;
    }
    const std::size_t size = mapped_size(bytes);
    if (void* block = state_->take_spare(size)) return block;
    state_->count(size);
    try {
        return map_block(size);
    } catch (const std::bad_alloc&) {
        state_->used -= size;
        throw;
    }
}

void MemoryBudget::do_deallocate(void* block, std::size_t bytes, std::size_t alignment) {
    const std::lock_guard lock(state_->mutex);
    if (bytes < kMapped) {
        state_->used -= bytes;
        ::operator delete(block, std::align_val_t(alignment));
        return;
    }
    const std::size_t size = mapped_size(bytes);
    state_->used -= size;
    state_->kept += size;
    state_->spare.push_back({size, block});
}

}  // namespace edgewise
