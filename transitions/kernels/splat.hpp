#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <mutex>

#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/pmr_block.hpp"

namespace edgewise::kernels {

// Splatting: each voxel adds its footprint, the integral of its kernel along parallel rays, to the
// picture. The kernel is that of trilinear interpolation, so that the sum over all voxels is the
// integral of the trilinear field.
//
// Frames used below:
//   index space  [voxel]  of the volume; centres at integers
//   screen       [pixel]  origin at the centre of the top-left pixel
//   across       [voxel]  the two axes of index space that rays are least steep to. Where a ray
//                         crosses slice k of the third, less the place of a voxel of that slice, is
//                         where the ray meets the voxel's footprint.
//
// Footprints are tables over `across` with some cells a voxel, and a place takes the value of the
// nearest entry. A whole number of cells lies between two voxels, so a ray is off by the same part
// of a cell for all voxels of a slice. It is thus moved by at most half a cell, a slice at a time,
// and kernels still add up to 1 exactly: there is no ripple.

/// Where a voxel lies along one axis. The field is that of trilinear interpolation, continued to
/// the faces of the volume, half a voxel beyond the outermost centres, and 0 farther out.
enum class Face { none, first, last, both };

/// Of voxel i of n.
constexpr Face face_of(std::int64_t i, std::int64_t n) noexcept {
    if (n == 1) return Face::both;
    return i == 0 ? Face::first : i == n - 1 ? Face::last : Face::none;
}

/// The kernel along one axis: a triangle from -1 to 1, at a face of the volume 1 as far as there.
double kernel_at(Face face, double x) noexcept;

/// Sections of a kernel along a ray, a voxel of the axis that it is steepest to.
inline constexpr int kSections = 16;

/// Tables of footprints of one view, made when they are first asked for. Any thread may ask.
class Footprints {
 public:
    /// What a place has: its footprint; or what of it lies before each section's begin, and all.
    enum class Depth { whole, sections };
    struct Shape {
        std::array<int, 2> across{};     // the axes of columns and rows
        int along = 2;                   // the third
        std::array<double, 2> slopes{};  // voxels of `across` a voxel of `along`; at most 1
        int cells = 32;                  // a voxel
        Depth depth = Depth::whole;

        /// Places along each side, from one end of a footprint to the other.
        int places(int side) const noexcept;
        /// Numbers of a place.
        int numbers() const noexcept { return depth == Depth::whole ? 1 : 2 * kSections + 1; }
        double bytes() const noexcept;
    };

    Footprints(const Shape& shape, std::pmr::memory_resource* memory);

    const Shape& shape() const noexcept { return shape_; }
    int columns() const noexcept { return columns_; }
    int rows() const noexcept { return rows_; }
    /// Places from row to row. Behind the last column and the last row stand zeros.
    int pitch() const noexcept { return columns_ + 1; }

    /// The footprint of a voxel with such faces along x, y and z, in voxels of `along`.
    /// @throws std::bad_alloc
    const float* of(const std::array<Face, 3>& faces);

 private:
    void make(const std::array<Face, 3>& faces, float* table) const;
    void add_section(const float* row, float scale, float* to) const;
    void append_section(const float* row, float scale, int section, float* to) const;

    static constexpr int kTables = 4 * 4 * 4;
    Shape shape_;
    std::pmr::memory_resource* memory_;
    int columns_, rows_;
    std::array<std::once_flag, kTables> made_;
    std::array<std::unique_ptr<Block<float>>, kTables> tables_;
};

/// Bits of a fraction of a voxel. Places wrap around at 2^12 voxels, which no footprint reaches.
inline constexpr int kPlaceBits = 20;

/// A place in fixed point: linear in pixel and voxel, so that sums are exact.
struct FixedPlace {
    std::uint32_t base = 0, px = 0, py = 0;
    std::array<std::uint32_t, 3> voxel{};

    /// Of voxel (x, y, z) at pixel (0, 0).
    std::uint32_t of(std::int64_t x, std::int64_t y, std::int64_t z) const noexcept {
        return base + static_cast<std::uint32_t>(x) * voxel[0] +
               static_cast<std::uint32_t>(y) * voxel[1] + static_cast<std::uint32_t>(z) * voxel[2];
    }
    std::uint32_t right(std::int64_t pixels) const noexcept {
        return static_cast<std::uint32_t>(pixels) * px;
    }
    std::uint32_t down(std::int64_t pixels) const noexcept {
        return static_cast<std::uint32_t>(pixels) * py;
    }
};

/// A voxel's centre along one axis of the screen.
struct PlaceOnScreen {
    double base = 0;
    std::array<double, 3> voxel{};

    double of(double x, double y, double z) const noexcept {
        return base + x * voxel[0] + y * voxel[1] + z * voxel[2];
    }
};

/// The samples of a row along x outside of which all are empty; none: begin = end.
struct SplatSpan {
    std::int32_t begin = 0, end = 0;
};

/// A volume and how it is seen.
struct Splat {
    Grid volume;      // one channel, any real type; its value map is not read
    float empty = 0;  // the stored number that adds nothing
    std::array<FixedPlace, 2> across;
    std::array<PlaceOnScreen, 2> screen;
    std::array<double, 2> reach{};  // of a footprint to either side of its middle [pixel]
    std::array<int, 2> patch{};     // pixels that it covers, at most
    Footprints* footprints = nullptr;
    const SplatSpan* spans = nullptr;  // of each row: y, then z
};

/// Finds the spans of the rows of slices [begin, end) along z. Single-threaded.
/// @param spans  that of row (0, 0) of the volume
void find_spans(const Splat& splat, std::int64_t begin, std::int64_t end, SplatSpan* spans);

/// Sums of pixels [begin, end) of the screen, with room around them for footprints that lie partly
/// beside: those of pixel (x, y) are at first[(y - begin[1]) * pitch + x - begin[0]].
struct SplatSums {
    std::array<std::int64_t, 2> begin{}, end{};
    float* first = nullptr;
    std::ptrdiff_t pitch = 0;

    /// Floats of a row, with its room.
    static std::int64_t pitch_of(const Splat& splat, std::int64_t width) noexcept;
    /// Floats of all rows, with their room.
    static std::int64_t floats_of(const Splat& splat, std::int64_t width,
                                  std::int64_t height) noexcept;
    /// Of these where the first pixel is.
    static std::int64_t first_of(const Splat& splat, std::int64_t width) noexcept;
};

/// A sample that is not empty, less what is.
struct Splatted {
    std::int32_t x;
    float value;
};

/// Adds the footprints of slices [begin, end) along z to the sums, each times the sample less
/// `empty`; in the order of memory, so that a sum does not depend on which pixels go with it.
/// Samples that are not finite add nothing. Single-threaded.
/// @param row  scratch for as many samples as the volume has along x
void splat(const Splat& splat, std::int64_t begin, std::int64_t end, const SplatSums& sums,
           Splatted* row);

}  // namespace edgewise::kernels
