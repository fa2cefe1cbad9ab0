#pragma once

#include <array>
#include <cstdint>

#include "graph/samples.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/tap_polynomials.hpp"

namespace edgewise::kernels {

/// Columns of an output row that are worked out together, from multiples of it on.
inline constexpr int kBackwardBlock = 16;
/// Bytes of an output whose lines come as fast as they are written; those of a larger one are asked
/// for a slice ahead. Of 1 to 23 MB that makes no difference; 81 MB that are made of bytes take
/// 0.53 (nearest) and 0.63 (linear) of the time.
inline constexpr std::int64_t kNearOutput = 16 << 20;

/// Where a warp writes: f32, channels interleaved as in the input.
struct WarpOutput {
    float* samples = nullptr;
    Region held;  // the box of output indices that lies in `samples`, x fastest
};

/// An output index -> input index map of images that is not affine: rows of a 3x3 matrix,
/// row-major.
using Homography = std::array<double, 9>;

/// What a warp does with every row, prepared once. Fields are for the kernels alone.
struct BackwardPlan {
    Grid input;
    Hold hold = Hold::foh;
    const Filter* filter = nullptr;           // of Hold::weighted
    const TapPolynomials* weights = nullptr;  // the same for lanes
    bool interpolates = false;  // of Hold::weighted: on a sample its value is the sample
    int below = 0;              // taps before the one below a place
    int axes = 3;               // 2: an image, whose z coordinate is ignored
    Affine map{};               // output index -> input index, snapped
    Homography homography{};    // used where `projective`
    bool projective = false;
    bool vector = false;  // false: the scalar path, for what lanes cannot count
    bool mapped = false;  // the value map is not the identity
    float slope = 1, offset = 0, outside = 0;
    std::array<std::int64_t, 3> extent{};  // samples
    std::array<std::int64_t, 3> stride{};  // bytes from one sample to the next
    std::array<std::int64_t, 3> next{};    // the same, 0 along an axis of one sample
    std::array<double, 3> inverse{};       // 1 / column step; 0 for a step of 0
    std::int64_t ahead = 0;  // input bytes from a place to about that of two output slices on
    std::array<std::int64_t, 3>
        step16{};  // 16 columns farther along the output row, 24.40 fixed point
    alignas(64) std::array<std::array<std::int32_t, 16>, 3> lane{};  // lane * column step, 9.23
};

/// Backward warp: every output sample is reconstructed at its place in the input (inverse map).
/// Frames  indices with centres at integers, output and input; no threads, no allocation, no errors
/// Border  a point belongs to the input up to half a sample beyond the outermost centres (1e-9
/// slack);
///         there the nearest sample continues; farther out the output is `outside`
/// Filters zoh floor(p + 1/2); foh; bspline3 on f32 coefficients (spline_prefilter), mirrored taps;
///         others by their weights, beyond the ends the outermost samples continue
/// Exact   identity, whole-sample shifts and quarter turns copy bytes for zoh and foh: entries of
/// the
///         map within 1e-12 of an integer, translations within 1e-9, are taken as that integer
/// Places  positions are right to 2^-22 sample whatever the row length: each 64 columns start from
///         f64, and lanes count in fixed point; so a value does not depend on the region either
/// Speed   u8, i8, u16, i16, f32 (bspline3: f32) in vector lanes; u32, i32, f16, f64, column steps
///         beyond 14 samples and volumes with several channels take a scalar path in f64
/// Source  [W93] FIGURE 26 and 27
class BackwardWarp {
 public:
    /// `input` and the filter of Hold::weighted must stay alive. Values are mapped (slope, offset)
    /// after reconstruction; `outside` is in mapped values.
    BackwardWarp(const Grid& input, const Affine& to_input, Hold hold, float outside,
                 const Filter* filter = nullptr);
    /// Images only: the input index is (u/w, v/w), and w <= 0 is outside.
    BackwardWarp(const Grid& input, const Homography& to_input, Hold hold, float outside,
                 const Filter* filter = nullptr);

    /// Fills `region` (within output.held).
    void operator()(const WarpOutput& output, const Region& region) const noexcept;

 private:
    BackwardPlan plan_;
};

/// The shape of region that keeps a turned footprint in the first-level cache; measured with the
/// 2048^2 f32 image and the 256^3 u8 volume turned by 30 degrees.
Extent preferred_tile(const Extent& output) noexcept;

}  // namespace edgewise::kernels
