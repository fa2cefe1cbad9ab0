#include "transitions/project/bricks_of.hpp"

#include <algorithm>
#include <tbb/parallel_for.h>

namespace edgewise {

std::unique_ptr<kernels::Bricks> bricks_of(const kernels::Grid& volume,
                                           const kernels::Optics* optics,
                                           std::pmr::memory_resource* memory,
                                           const std::function<bool()>& stopped) {
    auto bricks = std::make_unique<kernels::Bricks>(volume.extent, memory);
    constexpr std::int64_t kLayers = 4;
    const std::int64_t layers = bricks->extent.z;
    tbb::parallel_for(std::int64_t{0}, (layers + kLayers - 1) / kLayers, [&](std::int64_t i) {
        if (stopped && stopped()) return;
        const std::int64_t begin = i * kLayers;
        kernels::brick_layers(volume, optics, begin, std::min(begin + kLayers, layers), *bricks);
    });
    if (!stopped || !stopped()) kernels::spread_bricks(*bricks);
    return bricks;
}

}  // namespace edgewise
