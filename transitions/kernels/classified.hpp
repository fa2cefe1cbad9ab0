#pragma once

#include <cstddef>
#include <cstdint>

#include "transitions/kernels/combine.hpp"

namespace edgewise::kernels {

// A classified sample is four f32 that lie together: red, green and blue premultiplied by the
// opacity of the sample's cell (EQ 83), then the transparency of the cell (EQ 88). What sends no
// light and hides nothing is 0, 0, 0, 1.

inline constexpr int kClassified = 4;  // numbers of a sample

/// Classifies one row of one plane of a volume, as combine() with the rule `over` reads it: cells
/// outside the spans of their rays are 0, 0, 0, 1, those at their ends have the opacity of their
/// length. No allocation.
/// @param volume  one channel, any type
/// @param x, y, z  the first sample
/// @param low, high  spans of the row's rays, kSlack readable bytes behind
/// @param out  [width][4]
void classify_row(const Combining& with, const Grid& volume, std::int64_t x, std::int64_t y,
                  std::int64_t z, std::int64_t width, const float* low, const float* high,
                  float* out);

// Rows of `pixels` classified samples, or of what was composited of them: [pixels][4]. The result
// may lie on either input. No number depends on where a row begins or ends.

/// front over behind (EQ 86 and 87).
void over_row(const float* front, const float* behind, float* into, std::int64_t pixels);
/// Samples as they are seen through the transparency of `front`: light and transparency times that.
void attenuate_row(const float* front, const float* samples, float* into, std::int64_t pixels);
/// Light of both, transparency of the one behind: a sum of light that was attenuated before.
void add_row(const float* front, const float* behind, float* into, std::int64_t pixels);

}  // namespace edgewise::kernels
