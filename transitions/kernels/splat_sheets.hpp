#pragma once

#include <cstdint>

#include "transitions/kernels/splat.hpp"

namespace edgewise::kernels {

// Sheets: the picture's depth is cut into slabs of one thickness, planes across the rays. A voxel
// adds to the sheet of each slab what of its footprint lies in it. Over the length of the slab,
// that is the mean of the trilinear field there, one sample a ray.

/// Cells of a voxel in tables with sections.
inline constexpr int kSheetCells = 16;

/// A splat whose footprints have sections, and how sheets cut them.
struct SheetSplat {
    Splat splat;
    /// Where a ray meets the begin of sheet 0, along the axis it is steepest to; `voxel` takes the
    /// voxel's own place there off.
    FixedPlace along;
    std::uint32_t sheet = 0;  // from one sheet to the next, along that axis
    PlaceOnScreen depth;      // of a voxel's centre [sheet]
    double reach = 0;         // of a footprint to the front and to the back [sheet]

    /// Sheets that a footprint may lie in, at most.
    int sheets() const noexcept { return static_cast<int>(2 * reach) + 2; }
};

/// The number of the section of a voxel that begins nearest to a place along the axis that rays are
/// steepest to; of a place that half a section was added to. There sheets are cut: all voxels of a
/// ray agree about it.
constexpr std::int32_t section_of(std::uint32_t place) noexcept {
    return static_cast<std::int32_t>(place) >> (kPlaceBits - 4);
}
static_assert(kSections == 1 << 4);

struct SheetVoxel {
    std::int32_t x, y, z;
    float value;         // less what is empty
    std::int32_t sheet;  // the first that it may lie in
};

/// The voxels that are not empty and whose footprints meet the sums, in the order of memory.
/// @param list  null: they are counted only
/// @param row   scratch for as many samples as the volume has along x
/// @return how many
std::int64_t sheet_voxels(const SheetSplat& splat, const SplatSums& sums, Splatted* row,
                          SheetVoxel* list);

/// Adds what footprints have in sheets; sheet k is at sums.first + (k mod `planes`) * plane.
/// @param planes  at least splat.sheets()
void splat_sheets(const SheetSplat& splat, const SheetVoxel* list, std::int64_t count,
                  const SplatSums& sums, int planes, std::ptrdiff_t plane);

}  // namespace edgewise::kernels
