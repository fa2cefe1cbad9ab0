#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "graph/samples.hpp"

namespace edgewise::kernels {

/// Bytes that may be read behind the last sample of arrays of edgewise's own, so that a vector load
/// or a 32-bit gather of a narrow type never leaves the allocation. What stands there is never
/// used.
inline constexpr std::size_t kSlack = 64;

/// The last rows of samples behind which nothing may be read, copied to where kSlack bytes may.
/// Places are numbers: they may lie beside the array.
struct Tail {
    std::uintptr_t first = 0, bytes = 0;  // of the samples that are copied; 0: none are
    std::uintptr_t copy = 0;

    /// Where a row is read from that begins, or is entered, at a place.
    template <class T>
    const T* of(const T* row) const noexcept {
        const std::uintptr_t behind = reinterpret_cast<std::uintptr_t>(row) - first;
        return behind < bytes ? reinterpret_cast<const T*>(copy + behind) : row;  // NOLINT
    }
};

/// A dense array of samples to read: x fastest, then y, then z; channels of one sample lie
/// together. Of a larger whole it may hold a box: `samples` is then where sample (0, 0, 0) would
/// be, and only samples of the box are read.
struct Grid {
    const void* samples = nullptr;  // kSlack readable bytes behind the last one, or `end`
    Type type = Type::f32;
    Extent extent;
    int channels = 1;
    ValueMap values;                  // value = slope * stored + offset
    std::int64_t row = 0, slice = 0;  // samples from one to the next; 0: those of the extent
    /// Nothing is read from this place on; 0: `samples` have slack.
    std::uintptr_t end = 0;
    Tail tail = {};  // where there is an end

    std::int64_t row_step() const noexcept { return row > 0 ? row : extent.x; }
    std::int64_t slice_step() const noexcept { return slice > 0 ? slice : extent.x * extent.y; }
    bool whole() const noexcept { return row == 0; }
    template <class T>
    const T* as() const noexcept {
        return static_cast<const T*>(samples);
    }
    /// Numbers from the given one on, of which vectors may be loaded that begin in its row.
    template <class T>
    const T* row_from(std::int64_t first) const noexcept {
        return tail.of(as<T>() + first);
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
