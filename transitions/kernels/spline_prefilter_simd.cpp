#include "transitions/kernels/spline_prefilter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/spline_prefilter_simd.cpp"
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

/// A vector of lines that lie side by side, of which there are `lines`: at least one, at most a
/// vector's lanes. A line's results do not depend on how many go together.
template <bool kFull>
HWY_INLINE void filter_lanes(const Strip& strip, const StartWeights& start, std::int64_t first,
                             std::size_t lines) {
    const D d;
    const auto these = hn::FirstN(d, lines);
    const auto load = [&](const float* at) HWY_ATTR {
        if constexpr (kFull) return hn::LoadU(d, at);
        return hn::MaskedLoad(these, d, at);
    };
    const auto store = [&](V value, float* at) HWY_ATTR {
        if constexpr (kFull)
            hn::StoreU(value, d, at);
        else
            hn::BlendedStore(value, these, d, at);
    };
    const V pole = hn::Set(d, float(kPole)), gained = hn::Set(d, kGainedPole);
    float* at = strip.samples + first;
    V value = hn::Zero(d);
    for (int k = 0; k < start.count; ++k)
        value = hn::MulAdd(hn::Set(d, start.of[k]), load(at + k * strip.stride), value);
    store(value, at);
    V before = value;
    for (std::int64_t k = 1; k < strip.n; ++k) {
        before = value;
        at += strip.stride;
        value = hn::MulAdd(pole, value, load(at));
        store(value, at);
    }
    value = hn::Mul(hn::Set(d, kLast), hn::MulAdd(pole, before, value));
    store(value, at);
    for (std::int64_t k = 1; k < strip.n; ++k) {
        at -= strip.stride;
        value = hn::MulAdd(pole, value, hn::Mul(gained, load(at)));
        store(value, at);
    }
}

void filter_strip(const Strip& strip, const StartWeights& start) {
    const std::size_t lanes = hn::Lanes(D());
    const auto all = static_cast<std::size_t>(strip.lines);
    std::size_t line = 0;
    for (; line + lanes <= all; line += lanes)
        filter_lanes<true>(strip, start, static_cast<std::int64_t>(line), lanes);
    if (line < all) filter_lanes<false>(strip, start, static_cast<std::int64_t>(line), all - line);
}

/// Along x eight samples go together, whatever a vector has: how many decides what is rounded.
using DX = hn::CappedTag<float, 8>;
using VX = hn::Vec<DX>;

/// y[i] = u[i] + pole * y[i -+ 1] within one vector, by doubling: after the step of k lanes each
/// sum holds 2k terms. kForward runs to higher lanes.
template <bool kForward>
class Recursion {
 public:
    Recursion() {
        const int lanes = int(hn::Lanes(DX()));
        for (int lane = 0; lane < lanes; ++lane) {
            const int rank = kForward ? lane : lanes - 1 - lane;
            carry_weight_[lane] = float(std::pow(kPole, rank + 1));
            carry_from_[lane] = kForward ? lanes - 1 : 0;
            for (int step = 0; step < 3; ++step) {
                const int distance = 1 << step;
                const bool reached = rank >= distance;
                weight_[step][lane] = reached ? float(std::pow(kPole, distance)) : 0;
                from_[step][lane] = reached ? (kForward ? lane - distance : lane + distance) : lane;
            }
        }
    }

    /// `carry` holds the neighbour before the vector, in all lanes; becomes the vector's last.
    HWY_INLINE VX operator()(VX u, VX& carry) const {
        const DX d;
        for (int step = 0; (1 << step) < int(hn::Lanes(d)); ++step) {
            const VX moved = hn::TableLookupLanes(u, hn::SetTableIndices(d, from_[step].data()));
            u = hn::MulAdd(hn::Load(d, weight_[step].data()), moved, u);
        }
        u = hn::MulAdd(hn::Load(d, carry_weight_.data()), carry, u);
        carry = hn::TableLookupLanes(u, hn::SetTableIndices(d, carry_from_.data()));
        return u;
    }

 private:
    alignas(64) std::array<std::array<float, 8>, 3> weight_{};
    alignas(64) std::array<std::array<std::int32_t, 8>, 3> from_{};
    alignas(64) std::array<float, 8> carry_weight_{};
    alignas(64) std::array<std::int32_t, 8> carry_from_{};
};

/// A vector at row + x whose lanes beyond the row's n samples are 0.
HWY_INLINE VX load_part(const float* row, std::int64_t x, std::int64_t n) {
    alignas(64) float lanes[8] = {};
    std::copy(row + x, row + n, lanes);
    return hn::Load(DX(), lanes);
}

HWY_INLINE void store_part(VX value, float* row, std::int64_t x, std::int64_t n) {
    alignas(64) float lanes[8];
    hn::Store(value, DX(), lanes);
    std::copy(lanes, lanes + (n - x), row + x);
}

/// Lines along x: the recursion runs within vectors.
void filter_rows(float* row, std::int64_t n, std::int64_t rows, const StartWeights& start) {
    const DX d;
    const auto lanes = std::int64_t(hn::Lanes(d)), whole = n / lanes * lanes;
    const auto pole = float(kPole);
    const Recursion<true> causal;
    const Recursion<false> anticausal;
    const VX gained = hn::Set(d, kGainedPole);
    for (std::int64_t r = 0; r < rows; ++r, row += n) {
        float first = 0;
        for (int k = 0; k < start.count; ++k) first += start.of[k] * row[k];
        row[0] = first;
        VX carry = hn::Zero(d);
        for (std::int64_t x = 0; x < whole; x += lanes)
            hn::StoreU(causal(hn::LoadU(d, row + x), carry), d, row + x);
        if (whole < n) store_part(causal(load_part(row, whole, n), carry), row, whole, n);
        // The way back multiplies by the gained pole; its first term is set so that it comes out.
        row[n - 1] = kLast * (row[n - 1] + pole * row[n - 2]) / kGainedPole;
        carry = hn::Zero(d);
        if (whole < n) {
            const VX u = hn::Mul(gained, load_part(row, whole, n));
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
