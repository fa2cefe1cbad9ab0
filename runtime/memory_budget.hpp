#pragma once

#include <memory>
#include <memory_resource>

namespace edgewise {

/// A memory resource that counts and refuses: all samples and scratch of a run come from one.
/// Large blocks are mapped and kept for reuse by blocks of their size, since the first touch of a
/// page costs more than a trilinear pass reads; but only as far as the peak has room for them.
/// Those that nobody has asked for the longest go first. Of small blocks 1 MiB is kept, so that a
/// run that repeats another asks the system for nothing.
class MemoryBudget : public std::pmr::memory_resource {
 public:
    explicit MemoryBudget(std::size_t limit);
    ~MemoryBudget() override;
    std::size_t used() const noexcept;
    std::size_t peak() const noexcept;
    /// From now on the peak is counted anew.
    void reset_peak() noexcept;
    std::size_t limit() const noexcept;
    /// Gives back what is kept for reuse.
    void trim() noexcept;
    /// A block is its holder's from now on, and counts no more; still it is given back here. The
    /// second time nothing happens.
    /// @param bytes  as it was allocated
    /// @throws std::bad_alloc
    void give_away(const void* block, std::size_t bytes);

 protected:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override;
    void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override;

 private:
    bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
        return this == &other;
    }
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace edgewise
