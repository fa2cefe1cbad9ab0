#pragma once

#include <cstddef>
#include <memory_resource>
#include <vector>

namespace edgewise {

/// Where small objects come from that stand around samples and come and go with every run. What is
/// given back is used again: a run that does what one before it did asks the system for nothing.
/// Threads share it. It counts no bytes, and lives as long as the process, as results may outlive
/// all else.
std::pmr::memory_resource* small_objects();

/// The allocator of small_objects(). It holds nothing, so that containers of it are copied, moved
/// and compared as those of the standard allocator.
template <class T>
struct Recycled {
    using value_type = T;

    Recycled() = default;
    template <class U>
    Recycled(const Recycled<U>&) noexcept {}  // NOLINT: allocators are rebound

    T* allocate(std::size_t n) {
        return std::pmr::polymorphic_allocator<T>(small_objects()).allocate(n);
    }
    void deallocate(T* first, std::size_t n) noexcept {
        std::pmr::polymorphic_allocator<T>(small_objects()).deallocate(first, n);
    }
    friend bool operator==(const Recycled&, const Recycled&) noexcept { return true; }
};

/// For what is made in every run: tables of a few numbers or places. Samples come from
/// Context::memory, which counts them.
template <class T>
using SmallVector = std::vector<T, Recycled<T>>;

}  // namespace edgewise
