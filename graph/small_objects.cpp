#include "graph/small_objects.hpp"

#include <mutex>

namespace edgewise {
namespace {

class SmallObjects final : public std::pmr::memory_resource {
    void* do_allocate(std::size_t bytes, std::size_t alignment) override {
        const std::lock_guard lock(mutex_);
        return (bytes > kSmall ? tables_ : pool_).allocate(bytes, alignment);
    }
    void do_deallocate(void* block, std::size_t bytes, std::size_t alignment) override {
        const std::lock_guard lock(mutex_);
        (bytes > kSmall ? tables_ : pool_).deallocate(block, bytes, alignment);
    }
    bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
        return this == &other;
    }

    std::mutex mutex_;
    /// What is larger than a table comes from the system. Of tables few are there at a time, so
    /// that few are taken at once.
    static constexpr std::size_t kSmall = 1 << 12, kTable = 1 << 20;
    static constexpr std::size_t kTablesAtOnce = 4;
    std::pmr::unsynchronized_pool_resource pool_{{0, kSmall}, std::pmr::new_delete_resource()};
    std::pmr::unsynchronized_pool_resource tables_{{kTablesAtOnce, kTable},
                                                   std::pmr::new_delete_resource()};
};

}  // namespace

std::pmr::memory_resource* small_objects() {
#if defined(__SANITIZE_ADDRESS__)
    return std::pmr::new_delete_resource();  // what is lost in a pool would not be seen
#else
    static auto* const objects = new SmallObjects;  // results may outlive static objects
    return objects;
#endif
}

}  // namespace edgewise
