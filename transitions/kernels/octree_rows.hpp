#pragma once

#include <cstddef>

namespace edgewise::kernels {

/// Sums over rows of samples at each place along x: `n` of them, a multiple of kOctreeLanes.
struct OctreeSums {
    std::size_t n;
    float *low, *high;      // of finite samples
    float* gaps;            // how many are not
    double *sum, *squares;  // of the finite samples' differences from `origin`; null: unused
    float origin;
};

inline constexpr std::size_t kOctreeLanes = 16;

/// Adds a row of n samples, of a weight.
void add_octree_row(const float* row, double weight, const OctreeSums& to);

}  // namespace edgewise::kernels
