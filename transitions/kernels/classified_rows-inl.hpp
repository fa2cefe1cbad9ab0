// Classified voxels of a slice, from front to back. Compiled once a target (Highway's
// foreach_target). No pragma once: the guard toggles, so that every target sees the text once.
#if defined(EDGEWISE_CLASSIFIED_ROWS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_CLASSIFIED_ROWS_INL
#undef EDGEWISE_CLASSIFIED_ROWS_INL
#else
#define EDGEWISE_CLASSIFIED_ROWS_INL
#endif

#include <algorithm>
#include <array>

#include "hwy/highway.h"
#include "transitions/kernels/splat_ordered.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

using VoxelPlace = std::array<std::int64_t, 3>;

/// Calls use(voxel, its place) for the voxels of a slice, from front to back.
/// @param meets  of a row's first place and its axis, the places that may matter
template <class Meets, class Use>
void each_classified(const ClassifiedRows& rows, std::int64_t slice, const Meets& meets,
                     const Use& use) {
    const auto along = static_cast<std::size_t>(rows.axes[0]);
    const std::int64_t count = rows.count(1);
    VoxelPlace at{};
    at[static_cast<std::size_t>(rows.axes[2])] = slice;
    const auto before = [](const ClassifiedVoxel& voxel, std::int32_t place) {
        return voxel.place < place;
    };
    for (std::int64_t i = 0; i < count; ++i) {
        const std::int64_t row = rows.backwards[1] ? count - 1 - i : i;
        const std::int64_t* begin = rows.begins + slice * count + row;
        if (begin[0] == begin[1]) continue;
        at[static_cast<std::size_t>(rows.axes[1])] = row;
        at[along] = 0;
        const SplatSpan span = meets(at, along);
        if (span.begin >= span.end) continue;
        const ClassifiedVoxel* last = rows.voxels + begin[1];
        const ClassifiedVoxel* from =
            std::lower_bound(rows.voxels + begin[0], last, span.begin, before);
        const ClassifiedVoxel* to = std::lower_bound(from, last, span.end, before);
        const std::int64_t n = to - from;
        for (std::int64_t k = 0; k < n; ++k) {
            const ClassifiedVoxel& voxel = from[rows.backwards[0] ? n - 1 - k : k];
            at[along] = voxel.place;
            use(voxel, at);
        }
    }
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
