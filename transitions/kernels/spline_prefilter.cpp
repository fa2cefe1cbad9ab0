#include "transitions/kernels/spline_prefilter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/spline_prefilter.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

#ifndef EDGEWISE_SPLINE_PREFILTER_ONCE
#define EDGEWISE_SPLINE_PREFILTER_ONCE
namespace edgewise::kernels {

inline constexpr double kPole = -0.26794919243112270647;  // sqrt(3) - 2
inline constexpr float kGainedPole = float(-6 * kPole);   // the axis' gain enters with the way back
inline constexpr float kLast = float(6 * kPole / (kPole * kPole - 1));

/// Weights of the first samples in the causal recursion's start: the sum over the mirrored signal.
/// pole^32 is 5e-19, so that 32 terms are the whole sum of a longer axis.
struct StartWeights {
    std::array<float, 32> of{};
    int count = 0;

    explicit StartWeights(std::int64_t n) {
        count = int(std::min<std::int64_t>(n, 32));
        const double round_trip = std::pow(kPole, double(2 * n - 2));
        for (int k = 0; k < count; ++k) {
            double weight = std::pow(kPole, k);
            if (k > 0 && k < n - 1) weight += std::pow(kPole, double(2 * n - 2 - k));
            of[k] = float(weight / (1 - round_trip));
        }
    }
};

/// Parallel lines of n samples: line i begins at `samples + i`, its samples are `stride` apart.
struct Strip {
    float* samples;
    std::int64_t n, stride, lines;
};

}  // namespace edgewise::kernels
#endif

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;

/// One vector of lanes a step along lines that lie side by side.
HWY_INLINE void filter_lanes(const Strip& strip, const StartWeights& start, std::int64_t first) {
    const D d;
    const V pole = hn::Set(d, float(kPole)), gained = hn::Set(d, kGainedPole);
    float* at = strip.samples + first;
    V value = hn::Zero(d);
    for (int k = 0; k < start.count; ++k)
        value = hn::MulAdd(hn::Set(d, start.of[k]), hn::LoadU(d, at + k * strip.stride), value);
    hn::StoreU(value, d, at);
    V before = value;
    for (std::int64_t k = 1; k < strip.n; ++k) {
        before = value;
        at += strip.stride;
        value = hn::MulAdd(pole, value, hn::LoadU(d, at));
        hn::StoreU(value, d, at);
    }
    value = hn::Mul(hn::Set(d, kLast), hn::MulAdd(pole, before, value));
    hn::StoreU(value, d, at);
    for (std::int64_t k = 1; k < strip.n; ++k) {
        at -= strip.stride;
        value = hn::MulAdd(pole, value, hn::Mul(gained, hn::LoadU(d, at)));
        hn::StoreU(value, d, at);
    }
}

/// The same for one line: what is left where the lines do not fill a vector.
void filter_line(const Strip& strip, const StartWeights& start, std::int64_t line) {
    float* at = strip.samples + line;
    const auto pole = float(kPole);
    float value = 0;
    for (int k = 0; k < start.count; ++k) value += start.of[k] * at[k * strip.stride];
    at[0] = value;
    for (std::int64_t k = 1; k < strip.n; ++k)
        at[k * strip.stride] += pole * at[(k - 1) * strip.stride];
    float* last = at + (strip.n - 1) * strip.stride;
    *last = kLast * (*last + pole * *(last - strip.stride));
    for (float* p = last; p != at; p -= strip.stride)
        *(p - strip.stride) = pole * *p + kGainedPole * *(p - strip.stride);
}

void filter_strip(const Strip& strip, const StartWeights& start) {
    const auto lanes = std::int64_t(hn::Lanes(D()));
    std::int64_t line = 0;
    for (; line + lanes <= strip.lines; line += lanes) filter_lanes(strip, start, line);
    for (; line < strip.lines; ++line) filter_line(strip, start, line);
}

/// y[i] = u[i] + pole * y[i -+ 1] within one vector, by doubling: after the step of k lanes each
/// sum holds 2k terms. kForward runs to higher lanes.
template <bool kForward>
class Recursion {
 public:
    Recursion() {
        const int lanes = int(hn::Lanes(D()));
        for (int lane = 0; lane < lanes; ++lane) {
            const int rank = kForward ? lane : lanes - 1 - lane;
            carry_weight_[lane] = float(std::pow(kPole, rank + 1));
            carry_from_[lane] = kForward ? lanes - 1 : 0;
            for (int step = 0; step < 4; ++step) {
                const int distance = 1 << step;
                const bool reached = rank >= distance;
                weight_[step][lane] = reached ? float(std::pow(kPole, distance)) : 0;
                from_[step][lane] = reached ? (kForward ? lane - distance : lane + distance) : lane;
            }
        }
    }

    /// `carry` holds the neighbour before the vector, in all lanes; becomes the vector's last.
    HWY_INLINE V operator()(V u, V& carry) const {
        const D d;
        for (int step = 0; (1 << step) < int(hn::Lanes(d)); ++step) {
            const V moved = hn::TableLookupLanes(u, hn::SetTableIndices(d, from_[step].data()));
            u = hn::MulAdd(hn::Load(d, weight_[step].data()), moved, u);
        }
        u = hn::MulAdd(hn::Load(d, carry_weight_.data()), carry, u);
        carry = hn::TableLookupLanes(u, hn::SetTableIndices(d, carry_from_.data()));
        return u;
    }

 private:
    alignas(64) std::array<std::array<float, 16>, 4> weight_{};
    alignas(64) std::array<std::array<std::int32_t, 16>, 4> from_{};
    alignas(64) std::array<float, 16> carry_weight_{};
    alignas(64) std::array<std::int32_t, 16> carry_from_{};
};

/// A vector at row + x whose lanes beyond the row's n samples are 0.
HWY_INLINE V load_part(const float* row, std::int64_t x, std::int64_t n) {
    alignas(64) float lanes[16] = {};
    std::copy(row + x, row + n, lanes);
    return hn::Load(D(), lanes);
}

HWY_INLINE void store_part(V value, float* row, std::int64_t x, std::int64_t n) {
    alignas(64) float lanes[16];
    hn::Store(value, D(), lanes);
    std::copy(lanes, lanes + (n - x), row + x);
}

/// Lines along x: the recursion runs within vectors.
void filter_rows(float* row, std::int64_t n, std::int64_t rows, const StartWeights& start) {
    const D d;
    const auto lanes = std::int64_t(hn::Lanes(d)), whole = n / lanes * lanes;
    const auto pole = float(kPole);
    const Recursion<true> causal;
    const Recursion<false> anticausal;
    const V gained = hn::Set(d, kGainedPole);
    for (std::int64_t r = 0; r < rows; ++r, row += n) {
        float first = 0;
        for (int k = 0; k < start.count; ++k) first += start.of[k] * row[k];
        row[0] = first;
        V carry = hn::Zero(d);
        for (std::int64_t x = 0; x < whole; x += lanes)
            hn::StoreU(causal(hn::LoadU(d, row + x), carry), d, row + x);
        if (whole < n) store_part(causal(load_part(row, whole, n), carry), row, whole, n);
        // The way back multiplies by the gained pole; its first term is set so that it comes out.
        row[n - 1] = kLast * (row[n - 1] + pole * row[n - 2]) / kGainedPole;
        carry = hn::Zero(d);
        if (whole < n) {
            const V u = hn::Mul(gained, load_part(row, whole, n));
            store_part(anticausal(u, carry), row, whole, n);
        }
        for (std::int64_t x = whole - lanes; x >= 0; x -= lanes)
            hn::StoreU(anticausal(hn::Mul(gained, hn::LoadU(d, row + x)), carry), d, row + x);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(filter_strip);
HWY_EXPORT(filter_rows);

namespace {

constexpr std::int64_t kStrip = 64;  // lines side by side: four cache lines a step

/// Cuts `width` lines side by side, in each of `slabs` slabs, into strips.
void filter_across(float* samples, std::int64_t n, std::int64_t stride, std::int64_t width,
                   std::int64_t slabs, std::int64_t slab) {
    const StartWeights start(n);
    const std::int64_t strips = (width + kStrip - 1) / kStrip;
    tbb::parallel_for(std::int64_t{0}, strips * slabs, [&](std::int64_t i) {
        const std::int64_t first = i % strips * kStrip;
        const Strip strip{samples + i / strips * slab + first, n, stride,
                          std::min(kStrip, width - first)};
        HWY_DYNAMIC_DISPATCH(filter_strip)(strip, start);
    });
}

}  // namespace

void spline_prefilter(float* samples, const Extent& extent, int channels) {
    const std::int64_t nx = extent.x, ny = extent.y, nz = extent.z, row = nx * channels;
    if (extent.samples() == 0) return;
    if (nx > 1 && channels == 1) {
        const StartWeights start(nx);
        tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, ny * nz, 16), [&](const auto& rows) {
            HWY_DYNAMIC_DISPATCH(filter_rows)
            (samples + rows.begin() * nx, nx, rows.end() - rows.begin(), start);
        });
    } else if (nx > 1) {
        filter_across(samples, nx, channels, channels, ny * nz, row);
    }
    if (ny > 1) filter_across(samples, ny, row, row, nz, row * ny);
    if (nz > 1) filter_across(samples, nz, row * ny, row * ny, 1, 0);
}

}  // namespace edgewise::kernels
#endif
