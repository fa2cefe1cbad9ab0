#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "transitions/kernels/ray_cast.hpp"

namespace edgewise::kernels {

/// A convex hull by slabs in 13 directions: along the axes, the diagonals of the faces and those of
/// a cube (a 26-DOP, Klosowski and others 1998). Indices of samples, voxel centres at integers.
struct SlabHull {
    static constexpr std::size_t kSlabs = 13;
    static constexpr std::array<std::array<int, 3>, kSlabs> kNormal{{{1, 0, 0},
                                                                     {0, 1, 0},
                                                                     {0, 0, 1},
                                                                     {1, 1, 0},
                                                                     {1, -1, 0},
                                                                     {1, 0, 1},
                                                                     {1, 0, -1},
                                                                     {0, 1, 1},
                                                                     {0, 1, -1},
                                                                     {1, 1, 1},
                                                                     {1, 1, -1},
                                                                     {1, -1, 1},
                                                                     {-1, 1, 1}}};

    std::array<double, kSlabs> low, high;  // of normal . p; none: low > high

    SlabHull() noexcept;
    bool empty() const noexcept { return low[0] > high[0]; }
    void add(const std::array<double, 3>& least, const std::array<double, 3>& most) noexcept;
};

/// The hull of all bricks whose level is at least a bound, or above it.
/// @param volume  samples that bricks are of
SlabHull hull_of(const Bricks& bricks, const Extent& volume, float bound, bool above);

/// What a cast keeps of a volume, cut to a hull. Planes that cut nothing are left out.
/// @param wider  by which each slab is widened at both ends
Kept kept_in(const SlabHull& hull, const RayCast& cast,
             const std::array<double, SlabHull::kSlabs>& wider);

/// The longest way along each normal that rays take in a cell.
std::array<double, SlabHull::kSlabs> strides_along_normals(const RayCast& cast);

}  // namespace edgewise::kernels
