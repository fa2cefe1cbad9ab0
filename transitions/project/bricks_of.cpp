#include "transitions/project/bricks_of.hpp"

#include <algorithm>
#include <tbb/parallel_for.h>

namespace edgewise {

std::shared_ptr<kernels::Bricks> bricks_of(const kernels::Grid& volume, const kernels::LevelsOf& of,
                                           std::pmr::memory_resource* memory,
                                           const std::function<bool()>& stopped) {
    const std::pmr::polymorphic_allocator<kernels::Bricks> from_memory(memory);
    auto bricks = std::allocate_shared<kernels::Bricks>(from_memory, volume.extent, memory);
    if (of.ranges()) bricks->least.resize(bricks->level.size());
    const auto in_parallel = [&](std::int64_t count, std::int64_t at_once, const auto& make) {
        tbb::parallel_for(std::int64_t{0}, (count + at_once - 1) / at_once, [&](std::int64_t i) {
            if (stopped && stopped()) return;
            make(i * at_once, std::min((i + 1) * at_once, count));
        });
    };
    const Extent& n = bricks->extent;
    in_parallel(n.z, 4, [&](std::int64_t begin, std::int64_t end) {
        kernels::brick_layers(volume, of, begin, end, *bricks);
    });
    in_parallel(n.y, 16, [&](std::int64_t begin, std::int64_t end) {
        kernels::join_layers(volume, of, begin, end, *bricks);
    });
    std::pmr::vector<float>(memory).swap(bricks->least);
    return bricks;
}

}  // namespace edgewise
