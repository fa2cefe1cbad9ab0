#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "graph/samples.hpp"
#include "transitions/kernels/grid.hpp"

namespace edgewise::kernels {

/// One of the 48 signed permutations of the axes and a shift by whole samples:
///     out[i] = sign[i] * in[from[i]] + shift[i]
struct AxisPermutation {
    std::array<int, 3> from{0, 1, 2};
    std::array<int, 3> sign{1, 1, 1};
    std::array<std::int64_t, 3> shift{0, 0, 0};

    friend bool operator==(const AxisPermutation&, const AxisPermutation&) = default;
};

/// The signed permutation and shift that a map is: entries within 1e-12, translation within 1e-9 of
/// integers; nothing where it is none.
std::optional<AxisPermutation> axis_permutation(const Affine& map) noexcept;

/// The map of a signed permutation.
Affine affine_of(const AxisPermutation& permutation) noexcept;

/// The signed permutation that fits the extent into itself: shifts such that out starts at 0.
AxisPermutation into_place(AxisPermutation permutation, const Extent& in) noexcept;

/// Extent of the input behind the permutation.
Extent permuted_extent(const AxisPermutation& permutation, const Extent& in) noexcept;

/// The axis along which a direction advances fastest. A rounding error does not decide between
/// equals: of these the last is taken.
template <class Vector>
int fastest_axis(const Vector& along) {
    constexpr double kClearlyFaster = 1e-9;
    int axis = 2;
    for (int k = 1; k >= 0; --k)
        if (std::abs(along[k]) > std::abs(along[axis]) * (1 + kClearlyFaster)) axis = k;
    return axis;
}

/// Copies the samples of a region of the output, byte for byte; `outside` where there is no input.
/// Regions may be copied at the same time; regions of whole rows of some 32 y or more are quickest.
/// @param in            its type and channels do not matter
/// @param sample_bytes  of one sample, all channels together
/// @param outside       sample_bytes bytes
/// @param out           samples of the same size, those of the box `held` of the output
void copy_permuted(const Grid& in, std::size_t sample_bytes, const AxisPermutation& permutation,
                   const void* outside, void* out, const Region& held, const Region& region);
/// The same of whole arrays.
inline void copy_permuted(const void* in, const Extent& in_extent, std::size_t sample_bytes,
                          const AxisPermutation& permutation, const void* outside, void* out,
                          const Extent& out_extent, const Region& region) {
    const Grid grid{.samples = in, .extent = in_extent, .values = {}};
    copy_permuted(grid, sample_bytes, permutation, outside, out, Region::all(out_extent), region);
}

}  // namespace edgewise::kernels
