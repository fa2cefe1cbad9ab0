#pragma once

#include <cstddef>
#include <cstdint>

#include "transitions/kernels/ray_cast.hpp"

namespace edgewise::kernels {

/// What becomes of planes of samples that lie behind one another, one ray a pixel along z.
///
/// Sample z stands for the cell z - 1/2 .. z + 1/2, of length `step`. A ray may be inside the data
/// for low <= z <= high only: samples outside do not count, and what of the interval no sample's
/// cell covers belongs to the nearest one, so that constants keep their integral. (That is the
/// convention of RayCast, but for the place of the end samples, which here are fixed.)
struct Combining {
    Combine rule = Combine::max;
    const RayRule* other = nullptr;  // of Combine::other
    ValueMap values = {};            // of the stored numbers
    double step = 1;                 // length of a cell along the ray [t]
    double unit = 1;                 // one t, in the file's unit; of sum
    double zero = 0;                 // of sum: the value that adds nothing
    double miss = 0;                 // a ray without a sample
    double level = 0;                // of other: Request::level
    const Optics* optics = nullptr;  // of over
    double bound = 0;                // of over, as in RayCast
};

/// How a rule's numbers become results.
inline RayRule::Setting setting_of(const Combining& with) noexcept {
    return {with.values, with.step * with.unit, with.zero, with.miss, with.level};
}

/// What is kept of pixels while planes are added: a few planes of floats, of which only the
/// functions below know the meaning. Rows of `pitch` floats, a multiple of 16, kSlack bytes behind.
struct PixelStates {
    float* first = nullptr;
    std::ptrdiff_t pitch = 0;  // floats from row to row
    std::ptrdiff_t plane = 0;  // floats from plane to plane, at least rows * pitch

    /// Planes of a rule.
    static constexpr int planes(Combine rule, const RayRule* other = nullptr) noexcept {
        if (rule == Combine::other) return other->planes;
        return rule == Combine::max ? 1 : rule == Combine::over ? 4 : 3;
    }
    static constexpr std::ptrdiff_t pitch_of(std::int64_t width) noexcept {
        return static_cast<std::ptrdiff_t>((width + 15) / 16 * 16);
    }
};

/// The part of each ray inside the data [z], for the same pixels as the states; rows of `pitch`.
struct PixelSpans {
    const float* low = nullptr;
    const float* high = nullptr;
    std::ptrdiff_t pitch = 0;
};

/// States before the first plane.
void clear_states(const Combining& with, const PixelStates& states, std::int64_t width,
                  std::int64_t height);

/// Adds planes [begin, end) behind what the states hold. Single-threaded, no allocation.
/// @param volume  one channel, any type; its value map is not read
/// @param x, y    pixel of the volume that the first state belongs to
void combine(const Combining& with, const Grid& volume, std::int64_t x, std::int64_t y,
             std::int64_t width, std::int64_t height, std::int64_t begin, std::int64_t end,
             const PixelSpans& spans, const PixelStates& states);

/// into = into, then from behind it: max, + and over are associative (Lemma 4.1), over up to
/// rounding, so merge in one fixed tree.
void merge_states(const Combining& with, const PixelStates& into, const PixelStates& from,
                  std::int64_t width, std::int64_t height);

/// Pictures of finished states: 1 float a pixel; of over premultiplied r, g, b, opacity.
void finish_states(const Combining& with, const PixelStates& states, std::int64_t width,
                   std::int64_t height, float* out, std::ptrdiff_t row_floats);

}  // namespace edgewise::kernels
