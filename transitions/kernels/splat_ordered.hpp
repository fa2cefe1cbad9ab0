#pragma once

#include <array>
#include <cstdint>

#include "transitions/kernels/combine.hpp"
#include "transitions/kernels/splat.hpp"

namespace edgewise::kernels {

// Splatting of voxels that are classified first: each has a colour and an optical depth,
// -log(1 - opacity) a unit of length. A footprint's weight w is the length of ray that the voxel
// stands for there, and (1 - opacity)^w what it lets through. Slices of the volume's axes are
// visited from front to back.

/// A voxel that is seen.
struct ClassifiedVoxel {
    /// A weight of 1 lets through at least 2^-24, the step of f32 below 1: else what is opaque
    /// would be so as far as its footprint reaches.
    static constexpr double kOpaque = 16.635532333438686;

    std::int32_t place;  // along its row
    float depth;         // optical, a unit of the footprints' weights
    std::array<float, 3> color;
};

/// Voxels that are seen, row by row, and how they are visited.
struct ClassifiedRows {
    Extent extent;  // of the volume
    /// Of the volume: along a row; from row to row of a slice; from slice to slice.
    std::array<int, 3> axes{0, 1, 2};
    std::array<bool, 2> backwards{};       // along a row; from row to row
    const std::int64_t* begins = nullptr;  // of rows, slice by slice; and where the last one ends
    const ClassifiedVoxel* voxels = nullptr;

    std::int64_t count(std::size_t level) const noexcept { return extent[axes[level]]; }
    /// Whether a slice has any.
    bool has(std::int64_t slice) const noexcept {
        return begins[slice * count(1)] < begins[(slice + 1) * count(1)];
    }
};

/// A splat's footprints, whole ones, of such voxels.
struct OrderedSplat {
    Splat splat;  // of its volume only the extent is read, and no spans
    ClassifiedRows rows;
};

/// Composites the voxels of a slice, one after the other, behind what pixels hold: the light that
/// is left, then red, green, blue, `plane` floats apart. Pixels with at most `bound` left stay as
/// they are. Single-threaded.
void composite_voxels(const OrderedSplat& of, std::int64_t slice, const SplatSums& pixels,
                      std::ptrdiff_t plane, float bound);

/// Adds the voxels of a slice to a sheet: optical depths, then these times red, green, blue.
/// Single-threaded.
void add_to_sheet(const OrderedSplat& of, std::int64_t slice, const SplatSums& sheet,
                  std::ptrdiff_t plane);

/// Composites a sheet behind the pixels that it is of, like composite_voxels().
/// @param lengths  what each pixel's sums are multiplied by; rows as of `pixels`
/// @param pixels   rows of a multiple of 16 floats
/// @return whether any pixel has more than `bound` left
bool composite_sheet(const SplatSums& sheet, std::ptrdiff_t plane, const float* lengths,
                     const PixelStates& pixels, float bound);

}  // namespace edgewise::kernels
