#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <span>

#include "transitions/kernels/ray_cast.hpp"

namespace edgewise::kernels {

/// A brick of samples, and an upper bound of interpolated values in it.
struct SortedBrick {
    /// No value that a filter makes at a place of the brick is larger: stored numbers, negated
    /// where the slope is negative, so that the largest always counts.
    float bound = 0;
    std::int32_t place = 0;  // (k * ny + j) * nx + i
};

/// The bricks of a volume in descending order of their bounds; those that no ray gains from are
/// left out. One list serves all views (Mroz, Hauser, Groeller 2000).
struct SortedBricks {
    static constexpr int kSide = 8;  // samples

    std::span<const SortedBrick> bricks;
    /// What every ray that meets the volume has at least; -inf: a ray may have nothing.
    float floor = -std::numeric_limits<float>::infinity();
    Extent extent;  // bricks along each axis
    Extent volume;  // samples
};

/// Bricks along each axis of a volume.
inline Extent sorted_bricks_in(const Extent& volume) noexcept {
    constexpr std::int64_t side = SortedBricks::kSide;
    return {(volume.x + side - 1) / side, (volume.y + side - 1) / side,
            (volume.z + side - 1) / side};
}

/// Taps of a filter before the sample below a place, and behind it.
struct Reach {
    int before = 0, behind = 1;  // of filters up to first order; of the cubic B-spline 1 and 2
};

/// Bounds of the bricks of layers [begin, end) along z, in their places. Those without a finite
/// sample have -inf.
/// @param bricks  of the whole volume
/// @param memory  for rows of types that vectors do not read
/// @return the least that a finite sample of these layers counts as; none: inf
float bound_bricks(const Grid& volume, const Reach& reach, std::int64_t begin, std::int64_t end,
                   std::span<SortedBrick> bricks, std::pmr::memory_resource* memory);

/// Where a view has bricks.
struct ShownBricks {
    /// Pixels of their middles, in order.
    std::span<const std::array<float, 2>> middles;
    float half_width = 0, half_height = 0;  // of the pixels around it that one may matter to
};

/// Places that belong to a brick, and a little more than f32 places are rounded by [sample].
struct BrickBox {
    std::array<double, 3> low, high;

    BrickBox(const SortedBricks& of, std::int32_t place) noexcept {
        const auto nx = static_cast<std::int32_t>(of.extent.x),
                   ny = static_cast<std::int32_t>(of.extent.y);
        const std::int32_t row = place / nx, slice = row / ny;
        const std::array<std::int32_t, 3> at{place - row * nx, row - slice * ny, slice};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto n = static_cast<double>(of.volume[static_cast<int>(axis)]);
            const double margin = 1e-3 + 1e-6 * n, first = at[axis] * double(SortedBricks::kSide);
            // Half a sample beyond the outermost ones belongs to them.
            low[axis] = (at[axis] == 0 ? -0.5 : first) - margin;
            const double next = first + SortedBricks::kSide;
            high[axis] = (next >= n ? n - 0.5 : next) + margin;
        }
    }
    double middle(std::size_t axis) const noexcept { return 0.5 * (low[axis] + high[axis]); }
};
/// How far places of any brick are from the middle of its box [sample].
inline double half_of_brick(const SortedBricks& of) noexcept {
    const auto longest = static_cast<double>(std::max({of.volume.x, of.volume.y, of.volume.z}));
    return 0.5 * SortedBricks::kSide + 0.5 + 1e-3 + 1e-6 * longest;
}

constexpr int kSortedTile = 32;  // pixels along each side of a tile, at most

/// Fills width x height pixels from (x, y) on, at most kSortedTile each, by parallel rays: the
/// samples are those of ray_cast() with Combine::max, but brick after brick, the greatest bound
/// first. A brick is left out for packets of rays which all have seen as much, and all that are
/// left where all rays have. Each pixel is what ray_cast() makes of it, bit for bit.
/// @param order   places in `bricks` of those that the tile may see, ascending
/// @param room    sorted_room() bytes, aligned to 64: for one call after another
/// @return cells that were sampled, of each ray that has them
std::int64_t sorted_mip(const RayCast& cast, const SortedBricks& bricks, const ShownBricks& shown,
                        std::span<const std::int32_t> order, std::int64_t x, std::int64_t y,
                        std::int64_t width, std::int64_t height, float* out,
                        std::ptrdiff_t row_floats, std::byte* room);
/// Bytes that the rays of a tile keep.
std::size_t sorted_room();

}  // namespace edgewise::kernels
