#include <algorithm>
#include <cmath>
#include <limits>

#include "transitions/kernels/combine.hpp"

namespace edgewise::kernels {
namespace {

// Planes: max: the largest stored number, negated where the slope is negative. sum, mean: total,
// the block that is open, length. over: red, green, blue, the transparency that is left. other: the
// rule's own.

/// One pixel of finished states.
void finish(const Combining& with, const float* state, std::ptrdiff_t plane, float* out) {
    switch (with.rule) {
        case Combine::max: {
            const double stored = with.values.slope < 0 ? -*state : *state;
            *out = static_cast<float>(std::isfinite(*state) ? with.values(stored) : with.miss);
            return;
        }
        case Combine::sum:
        case Combine::mean: {
            const bool mean = with.rule == Combine::mean;
            const double weight = state[2 * plane];
            if (weight <= 0) {
                *out = mean ? static_cast<float>(with.miss) : 0.0f;
                return;
            }
            const double average = with.values((state[0] + state[plane]) / weight +
                                               origin_of_sums(with.rule, with.values, with.zero));
            *out = static_cast<float>(
                mean ? average : (average - with.zero) * weight * with.step * with.unit);
            return;
        }
        case Combine::over:
            for (int c = 0; c < 3; ++c) out[c] = state[with.optics->grey ? 0 : c * plane];
            out[3] = 1 - state[3 * plane];
            return;
        case Combine::other:
            with.other->finish(setting_of(with), state, plane, out);
            return;
        case Combine::hit:
            return;  // no edge combines slices for it
    }
}

/// One pixel: `from` lies behind `into`.
void merge(const Combining& with, float* into, std::ptrdiff_t plane, const float* from,
           std::ptrdiff_t from_plane) {
    switch (with.rule) {
        case Combine::max:
            *into = std::max(*into, *from);
            return;
        case Combine::sum:
        case Combine::mean:
            for (int p = 0; p < 3; ++p) into[p * plane] += from[p * from_plane];
            return;
        case Combine::over: {
            const float left = into[3 * plane];
            for (int c = 0; c < 3; ++c) into[c * plane] += left * from[c * from_plane];
            into[3 * plane] = left * from[3 * from_plane];
            return;
        }
        case Combine::other:
            with.other->join(into, plane, from, from_plane);
            return;
        case Combine::hit:
            return;
    }
}

}  // namespace

void clear_states(const Combining& with, const PixelStates& states, std::int64_t width,
                  std::int64_t height) {
    if (with.rule == Combine::other) {
        for (std::int64_t row = 0; row < height; ++row)
            with.other->clear(states.first + row * states.pitch, states.plane,
                              static_cast<int>(width));
        return;
    }
    for (int p = 0; p < PixelStates::planes(with.rule); ++p) {
        const float start = with.rule == Combine::max ? -std::numeric_limits<float>::infinity()
                            : with.rule == Combine::over && p == 3 ? 1.0f
                                                                   : 0.0f;
        for (std::int64_t row = 0; row < height; ++row)
            std::fill_n(states.first + p * states.plane + row * states.pitch, width, start);
    }
}

void merge_states(const Combining& with, const PixelStates& into, const PixelStates& from,
                  std::int64_t width, std::int64_t height) {
    for (std::int64_t row = 0; row < height; ++row)
        for (std::int64_t i = 0; i < width; ++i)
            merge(with, into.first + row * into.pitch + i, into.plane,
                  from.first + row * from.pitch + i, from.plane);
}

void finish_states(const Combining& with, const PixelStates& states, std::int64_t width,
                   std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    const int channels = with.rule == Combine::over    ? 4
                         : with.rule == Combine::other ? with.other->channels
                                                       : 1;
    for (std::int64_t row = 0; row < height; ++row)
        for (std::int64_t i = 0; i < width; ++i)
            finish(with, states.first + row * states.pitch + i, states.plane,
                   out + row * row_floats + i * channels);
}

}  // namespace edgewise::kernels
