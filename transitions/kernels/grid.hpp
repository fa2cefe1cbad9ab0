#pragma once

#include <array>
#include <cstddef>

#include "graph/samples.hpp"

namespace edgewise::kernels {

/// Bytes that may be read behind the last sample of every array, so that a vector load or a 32-bit
/// gather of a narrow type never leaves the allocation. What stands there is never used.
inline constexpr std::size_t kSlack = 64;

/// A dense array of samples to read: x fastest, then y, then z; channels of one sample lie
/// together. Of a larger whole it may hold a box: `samples` is then where sample (0, 0, 0) would
/// be, and only samples of the box are read.
struct Grid {
    const void* samples = nullptr;  // kSlack readable bytes behind the last one
    Type type = Type::f32;
    Extent extent;
    int channels = 1;
    ValueMap values;                  // value = slope * stored + offset
    std::int64_t row = 0, slice = 0;  // samples from one to the next; 0: those of the extent

    std::int64_t row_step() const noexcept { return row > 0 ? row : extent.x; }
    std::int64_t slice_step() const noexcept { return slice > 0 ? slice : extent.x * extent.y; }
    bool whole() const noexcept { return row == 0; }
    template <class T>
    const T* as() const noexcept {
        return static_cast<const T*>(samples);
    }
};

/// Types whose samples vectors read themselves; others go through scalar_load.
inline bool in_lanes(Type type) noexcept {
    return type == Type::u8 || type == Type::i8 || type == Type::u16 || type == Type::i16 ||
           type == Type::f32;
}

/// A map between index spaces, centres at integers: rows of a 3x4 matrix, row-major.
using Affine = std::array<double, 12>;

inline std::array<double, 3> apply(const Affine& m, double x, double y, double z) noexcept {
    return {m[0] * x + m[1] * y + m[2] * z + m[3], m[4] * x + m[5] * y + m[6] * z + m[7],
            m[8] * x + m[9] * y + m[10] * z + m[11]};
}

/// Reconstruction from samples: nearest, linear, cubic B-spline on prefiltered coefficients, or by
/// the weights of any other filter (transitions/filters), which are told at run time.
enum class Hold { zoh, foh, bspline3, weighted };

/// A place this near a sample is on it, as far as samples beside it that are not finite could spoil
/// its value: f32 places along a ray are off by some 2^-23 of the longest axis.
inline constexpr float kOnSample = 1e-3f;

}  // namespace edgewise::kernels
