#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "graph/transition.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/splat_ordered.hpp"

namespace edgewise {

// What edges share that classify voxels before they splat them, slice by slice.

/// The axes of a volume that is visited by slices of one axis: along a row, from row to row, from
/// slice to slice.
std::array<int, 3> axes_by_slices(int along) noexcept;

/// The voxels of a volume that are seen, classified on all threads; samples that are not finite are
/// not.
class ClassifiedRows {
 public:
    /// @param length  of a ray that a footprint of weight 1 stands for [t]
    ClassifiedRows(const Data& in, const Request& want, int along, double length,
                   const Context& context);

    /// Without directions.
    kernels::ClassifiedRows rows() noexcept;

    /// At most.
    static double bytes(const Representation& from, const Ask& ask) noexcept;
    /// Operations of all of it.
    static double operations(const Representation& from, const Ask& ask) noexcept;

 private:
    template <class Use>
    void each_seen(std::int64_t z, const Use& use) const;

    const Data& in_;
    const Request& want_;
    std::array<int, 3> axes_;
    double length_;
    kernels::Block<std::int64_t> begins_;
    std::optional<kernels::Block<kernels::ClassifiedVoxel>> voxels_;
};

/// Voxels that are seen, at most.
double voxels_seen(const Representation& from, const Ask& ask) noexcept;

/// Why voxels cannot be classified and splatted, whatever the rays, or "".
std::string no_classified_splats(const Ask& ask);

/// A tile of a picture, and the sheet that is added to it next.
class SheetTile {
 public:
    static constexpr std::int64_t kWidth = 64, kHeight = 32;  // it stays in the caches
    static constexpr int kPlanes = 4;

    /// Floats of one plane of a sheet, where its first pixel is, and from row to row.
    struct Layout {
        std::int64_t floats = 0, first = 0, pitch = 0;
    };
    SheetTile(const Region& tile, const Layout& layout, std::pmr::memory_resource* memory);
    static double bytes(const Layout& layout) noexcept;

    const kernels::SplatSums& sheet() const noexcept { return sheet_; }
    std::ptrdiff_t plane() const noexcept { return plane_; }
    /// What the sums of each pixel are multiplied by, 1 to begin with.
    float& length(std::int64_t x, std::int64_t y) noexcept { return lengths_[y * kWidth + x]; }
    /// Combines the sheet behind what the tile has, and clears it.
    /// @return whether anything behind can be seen
    bool composite() noexcept;
    /// Red, green, blue, opacity.
    void finish(Data& out) const noexcept;

 private:
    Region tile_;
    std::ptrdiff_t plane_;
    Array memory_;
    float *first_, *lengths_;
    kernels::SplatSums sheet_;
    kernels::PixelStates pixels_;
};

}  // namespace edgewise
