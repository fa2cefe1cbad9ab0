#pragma once

#include <cstddef>
#include <cstdint>

#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/stretch_map.hpp"

namespace edgewise::kernels {

/// What rays by stretches took; of one thread.
struct StretchesTaken {
    std::int64_t looks = 0;      // at the map
    std::int64_t passed = 0;     // of these, stretches that were passed by
    std::int64_t crossed = 0;    // and stretches of one value
    std::int64_t samples = 0;    // cells that were sampled
    std::int64_t unsampled = 0;  // cells that were not, before the ray ended
};

/// A picture by rays that go by stretches: a map tells how far a ray goes through nothing, through
/// one value, or through samples. Cells and their samples are those of ray_cast(), to the bit; of
/// one value a ray takes all cells whose samples would lie in the box as one, by their length.
///
/// Each ray walks alone: the lanes of a vector are samples one behind the other. So a pixel depends
/// on nothing but its ray.
struct StretchCast {
    const RayCast& cast;                     // Hold::foh; max, sum, mean, or over without light
    const OctreeStops* octree = nullptr;     // one of both
    const BrickDistances* bricks = nullptr;  // of max and over
    StretchesTaken* taken = nullptr;         // counts; null: nobody does
};

/// As ray_cast().
void stretch_cast(const StretchCast& by, std::int64_t x, std::int64_t y, std::int64_t width,
                  std::int64_t height, float* out, std::ptrdiff_t row_floats);

}  // namespace edgewise::kernels
