#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "graph/samples.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/columns.hpp"
#include "transitions/kernels/grid.hpp"

namespace edgewise::kernels {

/// One axis of samples, read at places that lie evenly about its middle: place i of m is at
/// (i - (m-1)/2) * step + (n-1)/2. Places beyond the outermost samples read these.
struct ScaledAxis {
    int taps = 1;                      // samples that a place reads
    std::vector<std::int64_t> sample;  // [m][taps], all of them samples of the axis
    std::vector<float> weight;         // [m][taps]

    /// The samples that places [begin, end) read.
    Columns reads(std::int64_t begin, std::int64_t end) const noexcept;
};

/// @param n, m    samples and places along the axis, at least 1
/// @param step    from place to place [sample]
/// @param filter  of coefficients: the axis is mirrored about its outermost ones
ScaledAxis scaled_axis(std::int64_t n, std::int64_t m, double step, const Filter& filter);

/// m cells that cover the voxels of n samples exactly; each is the mean of the voxels that it
/// covers, by their shares.
/// @param n, m  samples and cells along the axis, 1 <= m <= n
ScaledAxis averaged_axis(std::int64_t n, std::int64_t m);

/// Resampling along the axes, one after another: z, then y, then x of the result's slices, which
/// need nothing of each other. No threads, no allocation.
/// Frames  indices with centres at integers, of the samples and of the places
/// Source  [W93] 3.7, FIGURE 36, where each place gets the samples that it needs and interpolates
class Scaling {
 public:
    /// `volume` must stay alive: one channel, any type but complex.
    Scaling(const Grid& volume, std::array<ScaledAxis, 3> axes);

    /// Values of a box of places, one slice after another.
    /// @param out      its samples, f32, x fastest; rows of `row` floats, slices of `slice`
    /// @param scratch  scratch_floats(box) floats
    void operator()(const Region& box, float* out, std::ptrdiff_t row, std::ptrdiff_t slice,
                    float* scratch) const noexcept;
    /// The box of samples that a box of places reads.
    Region reads(const Region& box) const noexcept;
    std::size_t scratch_floats(const Region& box) const noexcept;

 private:
    void along_z(std::int64_t z, const Region& from, float* plane) const noexcept;

    Grid volume_;
    std::array<ScaledAxis, 3> axes_;
};

}  // namespace edgewise::kernels
