#pragma once

// The backward warp one sample at a time in f64: for types, steps and channels without vector
// lanes.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "transitions/kernels/backward_rows.hpp"

namespace edgewise::kernels {

/// A 16-bit float (IEEE 754 binary16) as stored.
struct Half {
    std::uint16_t bits;

    operator double() const noexcept {
        const int exponent = bits >> 10 & 31, fraction = bits & 1023;
        double value =
            exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(fraction + 1024, exponent - 25);
        if (exponent == 31) value = fraction ? std::nan("") : HUGE_VAL;
        return bits & 0x8000 ? -value : value;
    }
};

/// Taps along one axis: offsets in bytes and weights that are not zero, so that a NaN
/// outside of the footprint does not enter as 0 * NaN.
struct AxisTaps {
    int count = 0;
    static constexpr int kMost = 8;
    std::array<std::int64_t, kMost> offset{};
    std::array<double, kMost> weight{};

    void add(std::int64_t index, std::int64_t stride, double w) {
        if (w == 0) return;
        offset[count] = index * stride;
        weight[count++] = w;
    }
};

/// Whole-sample mirror, as often as needed: ... 2 1 | 0 1 ... n-1 | n-2 ...
inline std::int64_t mirrored(std::int64_t index, std::int64_t n) {
    if (n == 1) return 0;
    const std::int64_t period = 2 * (n - 1);
    index = (index % period + period) % period;
    return std::min(index, period - index);
}

inline AxisTaps taps_at(double p, std::int64_t n, std::int64_t stride, const BackwardPlan& plan) {
    const Hold hold = plan.hold;
    AxisTaps taps;
    p = std::clamp(p, 0.0, double(n - 1));
    if (hold == Hold::zoh) {
        taps.add(std::int64_t(std::floor(p + 0.5)), stride, 1);
        return taps;
    }
    const double cell = std::floor(p), f = p - cell, g = 1 - f;
    const auto i = std::int64_t(cell);
    if (hold == Hold::foh) {
        taps.add(i, stride, g);
        taps.add(std::min(i + 1, n - 1), stride, f);
        return taps;
    }
    if (hold == Hold::weighted) {
        std::array<double, AxisTaps::kMost> weights;
        plan.filter->weights(f, weights.data());
        const int first = 1 - plan.filter->taps / 2;
        for (int tap = 0; tap < plan.filter->taps; ++tap)
            taps.add(std::clamp<std::int64_t>(i + first + tap, 0, n - 1), stride, weights[tap]);
        return taps;
    }
    taps.add(mirrored(i - 1, n), stride, g * g * g / 6);
    taps.add(mirrored(i, n), stride, 2.0 / 3 - f * f * (2 - f) / 2);
    taps.add(mirrored(i + 1, n), stride, 2.0 / 3 - g * g * (1 + f) / 2);
    taps.add(mirrored(i + 2, n), stride, f * f * f / 6);
    return taps;
}

template <class T>
double weighted_sum(const std::uint8_t* samples, const std::array<AxisTaps, 3>& taps) {
    double sum = -0.0;  // what leaves every term as it is, also -0
    for (int k = 0; k < taps[2].count; ++k)
        for (int j = 0; j < taps[1].count; ++j)
            for (int i = 0; i < taps[0].count; ++i) {
                T stored;
                std::memcpy(&stored,
                            samples + taps[0].offset[i] + taps[1].offset[j] + taps[2].offset[k],
                            sizeof(T));
                sum += taps[0].weight[i] * taps[1].weight[j] * taps[2].weight[k] * double(stored);
            }
    return sum;
}

/// Input position of output index (x, y, z), or false where there is none.
inline bool position_at(const BackwardPlan& plan, double x, double y, double z,
                        std::array<double, 3>& p) {
    if (plan.projective) {
        const Homography& h = plan.homography;
        const double w = h[6] * x + h[7] * y + h[8];
        p = {(h[0] * x + h[1] * y + h[2]) / w, (h[3] * x + h[4] * y + h[5]) / w, 0};
        if (!(w > 0)) return false;
    } else {
        p = apply(plan.map, x, y, z);
    }
    for (int a = 0; a < plan.axes; ++a) {
        const Range seen = seen_range(plan.extent[a]);
        if (!(p[a] >= seen.low && p[a] <= seen.high)) return false;
    }
    return true;
}

template <class T>
void backward_scalar(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    const auto* samples = plan.input.as<std::uint8_t>();
    const int channels = plan.input.channels;
    for (std::int64_t z = region.begin[2]; z < region.end[2]; ++z)
        for (std::int64_t y = region.begin[1]; y < region.end[1]; ++y) {
            float* row = row_of(plan, output, y, z);
            for (std::int64_t x = region.begin[0]; x < region.end[0]; ++x) {
                std::array<double, 3> p{};
                if (!position_at(plan, double(x), double(y), double(z), p)) {
                    fill_columns(plan, row, x, x + 1);
                    continue;
                }
                std::array<AxisTaps, 3> taps;
                taps[2].add(0, 0, 1);
                for (int a = 0; a < plan.axes; ++a)
                    taps[a] = taps_at(p[a], plan.extent[a], plan.stride[a], plan);
                for (int c = 0; c < channels; ++c) {
                    const double value = weighted_sum<T>(samples + c * sizeof(T), taps);
                    row[x * channels + c] = float(plan.mapped ? plan.input.values(value) : value);
                }
            }
        }
}

}  // namespace edgewise::kernels
