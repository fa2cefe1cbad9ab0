#include "runtime/memory_budget.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <iterator>
#include <mutex>
#include <new>
#include <set>
#include <sys/mman.h>
#include <vector>

namespace edgewise {
namespace {

/// From here on blocks are mapped and kept, not malloced: malloc gives scratch of this size back to
/// the system at once, and each tile would touch all of its pages anew.
constexpr std::size_t kMapped = std::size_t{1} << 16;
constexpr std::size_t kHugePage = std::size_t{2} << 20;
constexpr std::size_t kPage = 4096;

/// Bytes of small blocks that are kept. None under AddressSanitizer, which would not see that one
/// was used after it was given back.
#if defined(__SANITIZE_ADDRESS__)
constexpr std::size_t kSmallKept = 0;
#else
constexpr std::size_t kSmallKept = std::size_t{1} << 20;
#endif
constexpr std::size_t kSmallAlignment = 64;

/// What small blocks are rounded up to: four sizes from one power of two to the next.
struct SmallSize {
    std::size_t index, bytes;

    static SmallSize of(std::size_t bytes) noexcept {
        constexpr std::size_t kLeast = 64, kFirst = 6;  // 2^6
        const std::size_t least = std::max(bytes, kLeast);
        const auto power = static_cast<std::size_t>(std::bit_width(least - 1));
        const std::size_t unit = std::size_t{1} << (power - 3), units = (least + unit - 1) / unit;
        return {4 * (power - kFirst) + units - 5, units * unit};
    }
};
constexpr std::size_t kSmallSizes = 4 * (16 - 6) + 4;  // up to kMapped, 2^16

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
    /// A small block that waits for reuse holds the next one of its size.
    struct Small {
        Small* next;
    };
    std::mutex mutex;
    std::size_t limit = 0, used = 0, kept = 0, peak = 0, small_kept = 0;
    std::vector<Spare> spare;  // mapped blocks that wait for reuse; the last released is last
    std::array<Small*, kSmallSizes> small{};
    std::set<const void*> given;  // away, and not yet back

    void drop_spare() {
        while (!spare.empty()) drop_one();
    }
    /// Frees the least recently used block: blocks of an earlier path may be larger than all that
    /// a frame of this path needs.
    void drop_one() {
        munmap(spare.front().block, spare.front().bytes);
        kept -= spare.front().bytes;
        spare.erase(spare.begin());
    }
    void drop_small() {
        for (Small*& first : small)
            while (first) {
                Small* const gone = first;
                first = gone->next;
                ::operator delete(gone, std::align_val_t(kSmallAlignment));
            }
        small_kept = 0;
    }
    /// The caller has counted it.
    void* make_small(std::size_t bytes, std::size_t alignment) {
        const SmallSize size = SmallSize::of(bytes);
        const bool keeps = alignment <= kSmallAlignment;
        if (keeps && small[size.index]) {
            Small* const first = small[size.index];
            small[size.index] = first->next;
            small_kept -= size.bytes;
            return first;
        }
        return keeps ? ::operator new(size.bytes, std::align_val_t(kSmallAlignment), std::nothrow)
                     : ::operator new(bytes, std::align_val_t(alignment), std::nothrow);
    }
    void end_small(void* block, std::size_t bytes, std::size_t alignment) {
        const SmallSize size = SmallSize::of(bytes);
        if (alignment > kSmallAlignment)
            ::operator delete(block, std::align_val_t(alignment));
        else if (small_kept + size.bytes > kSmallKept)
            ::operator delete(block, std::align_val_t(kSmallAlignment));
        else {
            small[size.index] = new (block) Small{small[size.index]};
            small_kept += size.bytes;
        }
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
        if (small_kept > 0 && used + kept + small_kept > limit) drop_small();
    }
};

MemoryBudget::MemoryBudget(std::size_t limit) : state_(std::make_unique<State>()) {
    state_->limit = limit;
}
MemoryBudget::~MemoryBudget() { trim(); }

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
    state_->drop_small();
}

void MemoryBudget::give_away(const void* block, std::size_t bytes) {
    const std::lock_guard lock(state_->mutex);
    if (state_->given.insert(block).second)
        state_->used -= bytes < kMapped ? bytes : mapped_size(bytes);
}

void* MemoryBudget::do_allocate(std::size_t bytes, std::size_t alignment) {
    const std::lock_guard lock(state_->mutex);
    if (bytes < kMapped) {
        state_->count(bytes);
        void* block = state_->make_small(bytes, alignment);
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
    const bool counted = state_->given.erase(block) == 0;
    if (bytes < kMapped) {
        if (counted) state_->used -= bytes;
        state_->end_small(block, bytes, alignment);
        return;
    }
    const std::size_t size = mapped_size(bytes);
    if (!counted) {
        munmap(block, size);  // it was not counted, so there may be no room to keep it
        return;
    }
    state_->used -= size;
    state_->kept += size;
    state_->spare.push_back({size, block});
}

}  // namespace edgewise
