// Elliptical Gaussian footprints of voxels. Compiled once a target (Highway's foreach_target). No
// pragma once: the guard toggles, so that every target sees the text once.
#if defined(EDGEWISE_SPLAT_EWA_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_SPLAT_EWA_INL
#undef EDGEWISE_SPLAT_EWA_INL
#else
#define EDGEWISE_SPLAT_EWA_INL
#endif

#include <algorithm>
#include <array>
#include <cmath>

#include "hwy/highway.h"
#include "transitions/kernels/splat-inl.hpp"
#include "transitions/kernels/splat_ewa.hpp"
//
#include "hwy/contrib/math/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

static_assert(kMost <= kEwaRoom);
constexpr double kCut = EwaSplat::kRadius * EwaSplat::kRadius;  // of squared distances

/// What of a voxel is seen: a Gaussian of height `peak` at `middle`. At (dx, dy) from there its
/// squared distance, in standard deviations, is across (dx + lean dy)^2 + down dy^2: a sum of
/// squares, of which f32 loses little however slanted an ellipse is.
struct Footprint {
    double middle[2];
    double reach[2];  // to either side [pixel]
    float across, lean, down, peak;
};

class OnScreen {
 public:
    explicit OnScreen(const EwaSplat& splat) : splat_(splat) {
        const auto dot = [&](const PlaceOnScreen& a, const PlaceOnScreen& b) {
            return a.voxel[0] * b.voxel[0] + a.voxel[1] * b.voxel[1] + a.voxel[2] * b.voxel[2];
        };
        const auto& [x, y] = splat.screen;
        xx_ = dot(x, x), xy_ = dot(x, y), yy_ = dot(y, y);
        xz_ = dot(x, splat.depth), yz_ = dot(y, splat.depth), zz_ = dot(splat.depth, splat.depth);
        // What the cut leaves of a Gaussian in two dimensions.
        peak_ = splat.mass / (2 * kPi * (1 - std::exp(-kCut / 2)));
    }

    /// Of a voxel before the eye.
    HWY_INLINE Footprint of(double x, double y, double z, float value) const {
        const double depth = splat_.depth.of(x, y, z), larger = splat_.plane / depth;
        Footprint seen;
        double slope[2];
        for (std::size_t i = 0; i < 2; ++i) {
            const double beside = splat_.screen[i].of(x, y, z) - splat_.eye[i];
            seen.middle[i] = splat_.eye[i] + beside * larger;
            // The ray that matters is the picture's nearest one to the voxel.
            slope[i] = std::min(std::max(beside / depth, splat_.least[i]), splat_.greatest[i]);
        }
        // The kernel is swept along the ray onto the plane of the voxel's depth.
        const double scale = splat_.variance * larger * larger, low = splat_.low_pass;
        const auto [a, b] = slope;
        const double xx = scale * (xx_ - 2 * a * xz_ + a * a * zz_) + low,
                     yy = scale * (yy_ - 2 * b * yz_ + b * b * zz_) + low,
                     xy = scale * (xy_ - a * yz_ - b * xz_ + a * b * zz_);
        const double determinant = xx * yy - xy * xy;
        seen.reach[0] = EwaSplat::kRadius * std::sqrt(xx);
        seen.reach[1] = EwaSplat::kRadius * std::sqrt(yy);
        seen.across = static_cast<float>(yy / determinant);
        seen.lean = static_cast<float>(-xy / yy);
        seen.down = static_cast<float>(1 / yy);
        seen.peak = static_cast<float>(peak_ * larger * larger / std::sqrt(determinant) *
                                       static_cast<double>(value));
        return seen;
    }

    /// Which voxels of a row may have footprints that meet the sums, and perhaps some more.
    /// @param at    the row's first place
    /// @param axis  that it lies along
    SplatSpan meeting(const SplatSpan& span, const SplatSums& sums,
                      const std::array<std::int64_t, 3>& at, std::size_t axis) const {
        Kept kept{double(span.begin), double(span.end) - 1};
        const Line depth = line_of(splat_.depth, at, axis);
        const double nearest = std::min(depth.at(kept.from), depth.at(kept.to));
        if (!(nearest > 0)) return span;
        const double larger = splat_.plane / nearest;
        for (std::size_t i = 0; i < 2; ++i) {
            const double reach =
                1 + EwaSplat::kRadius *
                        std::sqrt(splat_.variance * larger * larger * widest(i) + splat_.low_pass);
            const double low = double(sums.begin[i]) - reach - splat_.eye[i];
            const double high = double(sums.end[i]) - 1 + reach - splat_.eye[i];
            Line beside = line_of(splat_.screen[i], at, axis);
            beside.base -= splat_.eye[i];
            kept.where_positive(beside * splat_.plane - depth * low);
            kept.where_positive(depth * high - beside * splat_.plane);
        }
        const double from = std::max(std::floor(kept.from), double(span.begin));
        const double to = std::min(std::ceil(kept.to) + 1, double(span.end));
        if (!(from < to)) return {};
        return {static_cast<std::int32_t>(from), static_cast<std::int32_t>(to)};
    }

 private:
    static constexpr double kPi = 3.14159265358979323846;

    /// A linear function along a row of voxels.
    struct Line {
        double base, step;

        double at(double x) const { return base + x * step; }
        Line operator*(double by) const { return {base * by, step * by}; }
        Line operator-(const Line& other) const { return {base - other.base, step - other.step}; }
    };
    struct Kept {
        double from, to;

        void where_positive(const Line& line) {
            if (line.step > 0) from = std::max(from, -line.base / line.step);
            if (line.step < 0) to = std::min(to, -line.base / line.step);
            if (line.step == 0 && line.base < 0) to = from - 2;
        }
    };
    static Line line_of(const PlaceOnScreen& place, const std::array<std::int64_t, 3>& at,
                        std::size_t axis) {
        return {place.of(double(at[0]), double(at[1]), double(at[2])), place.voxel[axis]};
    }
    /// Of all slopes of the picture's rays, the most that a unit variance has along a side.
    double widest(std::size_t side) const {
        const double own = side == 0 ? xx_ : yy_, with = side == 0 ? xz_ : yz_;
        const auto at = [&](double slope) { return own - 2 * slope * with + slope * slope * zz_; };
        return std::max(at(splat_.least[side]), at(splat_.greatest[side]));
    }

    const EwaSplat& splat_;
    double xx_, xy_, yy_, xz_, yz_, zz_, peak_;
};

/// Calls use(heights, pixels) for each vector of the pixels that a footprint has of the sums.
template <class Use>
HWY_INLINE void each_height(const Footprint& seen, const SplatSums& sums, const Use& use) {
    const Floats d;
    constexpr auto kStep = static_cast<std::int64_t>(kMost);
    double first[2], last[2];
    for (std::size_t i = 0; i < 2; ++i) {
        first[i] = std::ceil(seen.middle[i] - seen.reach[i]);
        last[i] = std::floor(seen.middle[i] + seen.reach[i]);
        if (!(first[i] < double(sums.end[i]) && last[i] >= double(sums.begin[i]))) return;
    }
    // Places count from the footprint's own first pixel, never from where the sums begin: a pixel
    // is the same whichever others are worked out with it.
    const double clipped = std::max(first[0], double(sums.begin[0]));
    const auto left = static_cast<std::int64_t>(clipped);
    const auto before = static_cast<float>(clipped - first[0]);
    const auto right = static_cast<std::int64_t>(std::min(last[0], double(sums.end[0]) - 1)) + 1;
    const auto top = static_cast<std::int64_t>(std::max(first[1], double(sums.begin[1])));
    const auto bottom = static_cast<std::int64_t>(std::min(last[1], double(sums.end[1]) - 1)) + 1;
    const VF begin = hn::Set(d, static_cast<float>(first[0] - seen.middle[0])),
             count = hn::Set(d, static_cast<float>(last[0] - first[0])),
             across = hn::Set(d, seen.across), peak = hn::Set(d, seen.peak),
             half = hn::Set(d, -0.5f), most = hn::Set(d, static_cast<float>(kCut));
    const VF lanes = hn::Iota(d, before);
    for (std::int64_t y = top; y < bottom; ++y) {
        const auto dy = static_cast<float>(double(y) - seen.middle[1]);
        const VF lean = hn::Set(d, seen.lean * dy), down = hn::Set(d, seen.down * dy * dy);
        float* row = sums.first + (y - sums.begin[1]) * sums.pitch;
        for (std::int64_t x = left; x < right; x += kStep) {
            const VF place = hn::Add(lanes, hn::Set(d, static_cast<float>(x - left)));
            const VF dx = hn::Add(hn::Add(begin, place), lean);
            const VF distance = hn::MulAdd(hn::Mul(across, dx), dx, down);
            const auto mine = hn::And(hn::Le(distance, most), hn::Le(place, count));
            const VF height = hn::Mul(peak, hn::Exp(d, hn::Mul(half, distance)));
            use(hn::IfThenElseZero(mine, height), row + (x - sums.begin[0]));
        }
    }
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
