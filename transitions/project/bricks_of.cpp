#include "transitions/project/bricks_of.hpp"

#include <algorithm>
#include <optional>
#include <tbb/parallel_for.h>

namespace edgewise {
namespace {

constexpr const char* kKind = "bricks";

/// Bricks with all that their levels hang on.
struct BricksBy {
    const void* samples;
    ValueMap values;
    std::optional<kernels::Optics> optics;
    kernels::Overshoot overshoot;
    std::shared_ptr<const kernels::Bricks> bricks;

    bool fits(const kernels::Grid& volume, const kernels::LevelsOf& of) const {
        return samples == volume.samples && values == volume.values &&
               optics.has_value() == (of.optics != nullptr) && (!optics || *optics == *of.optics) &&
               overshoot == of.overshoot;
    }
};

}  // namespace

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

std::shared_ptr<const kernels::Bricks> bricks_beside(const Data& data, const kernels::Grid& volume,
                                                     const kernels::LevelsOf& of,
                                                     std::pmr::memory_resource* memory,
                                                     const std::function<bool()>& stopped) {
    const bool may_be_kept =
        data.worked_out && !of.table && volume.samples == data.samples.data() && volume.whole();
    if (may_be_kept)
        if (const auto kept = data.worked_out->find<BricksBy>(
                kKind, [&](const BricksBy& by) { return by.fits(volume, of); }))
            return kept->bricks;
    std::shared_ptr<const kernels::Bricks> made =
        bricks_of(volume, of, may_be_kept ? data.worked_out->memory() : memory, stopped);
    if (may_be_kept && !(stopped && stopped()))
        data.worked_out->keep(
            kKind, std::make_shared<const BricksBy>(BricksBy{
                       volume.samples, volume.values,
                       of.optics ? std::optional(*of.optics) : std::nullopt, of.overshoot, made}));
    return made;
}

}  // namespace edgewise
