#pragma once

#include <memory_resource>

#include "transitions/kernels/fourier.hpp"
#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/stop.hpp"

namespace edgewise::kernels {

/// Least period of a picture [pixel] along one axis such that what the period repeats stays outside
/// the picture.
///
/// @param extent  of the picture
/// @param from    where the volume begins and ends on the picture [pixel], `to` > `from`
/// @return a multiple of `multiple` (1, 2 or 4) with small prime factors
std::int64_t picture_period(std::int64_t extent, double from, double to, std::int64_t multiple = 1);

/// The top left `picture` pixels of the inverse transform of a slice; not normalised.
///
/// @param slice  [period.y, period.x / 2 + 1] complex samples; it is kept
/// @param out    [picture.y, picture.x]
/// @param stop   true: returns soon, with `out` unfinished
/// Bytes do not depend on the number of threads.
void picture_of_slice(const Complex* slice, const Extent& period, const Extent& picture, float* out,
                      std::pmr::memory_resource* memory, const Stop& stop);

/// Bytes of scratch: for all, and for each thread.
double picture_workspace(const Extent& period, const Extent& picture) noexcept;
double picture_scratch(const Extent& period) noexcept;
double picture_operations(const Extent& period, const Extent& picture) noexcept;

/// Length of a ray within a box of voxels, in pixels along screen z: what a constant 1 adds up to.
class Chord {
 public:
    /// @param volume     fills its voxels to half a spacing beyond the outermost centres
    /// @param to_screen  object space [voxel] -> screen space [pixel], affine
    Chord(const Extent& volume, const Affine& to_screen);
    /// Of the ray through the centre of pixel (x, y); 0 where it misses.
    double at(double x, double y) const noexcept;

 private:
    std::array<double, 3> from_{}, along_{}, per_x_{}, per_y_{}, extent_{};
};

}  // namespace edgewise::kernels
