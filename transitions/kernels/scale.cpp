#include "transitions/kernels/scale.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "graph/with_type.hpp"
#include "transitions/kernels/scalar_load.hpp"

namespace edgewise::kernels {
namespace {

constexpr int kMostTaps = 8;

/// Whole-sample mirror, for the few coefficients beyond the outermost: -1 is 1, n is n - 2.
std::int64_t mirror_of(std::int64_t i, std::int64_t n) {
    if (n == 1) return 0;
    const std::int64_t period = 2 * (n - 1);
    i = (i % period + period) % period;
    return std::min(i, period - i);
}

/// sum[x] (+)= weight * row[x]; the first row of a sum needs no zeros before it.
template <class T>
void add_row(const T* row, float weight, std::int64_t n, bool first, float* sum) {
    if (first)
        for (std::int64_t x = 0; x < n; ++x) sum[x] = weight * static_cast<float>(row[x]);
    else
        for (std::int64_t x = 0; x < n; ++x) sum[x] += weight * static_cast<float>(row[x]);
}

struct HalfFloat {
    std::uint16_t bits;
    explicit operator float() const noexcept { return float_of_half(bits); }
};

}  // namespace

Columns ScaledAxis::reads(std::int64_t begin, std::int64_t end) const noexcept {
    Columns read{sample[static_cast<std::size_t>(begin * taps)], 0};
    for (std::int64_t i = begin * taps; i < end * taps; ++i) {
        read.begin = std::min(read.begin, sample[static_cast<std::size_t>(i)]);
        read.end = std::max(read.end, sample[static_cast<std::size_t>(i)] + 1);
    }
    return read;
}

ScaledAxis scaled_axis(std::int64_t n, std::int64_t m, double step, const Filter& filter) {
    const auto place = [&](std::int64_t i) {
        const double p = (static_cast<double>(i) - static_cast<double>(m - 1) / 2) * step +
                         static_cast<double>(n - 1) / 2;
        return std::clamp(p, 0.0, static_cast<double>(n - 1));
    };
    // Samples that a grid keeps are kept as they are; coefficients are none.
    bool kept = !filter.coefficients;
    for (std::int64_t i = 0; i < m && kept; ++i) kept = place(i) == std::floor(place(i));
    ScaledAxis axis;
    axis.taps = kept ? 1 : filter.taps;
    for (std::int64_t i = 0; i < m; ++i) {
        const double p = place(i);
        if (axis.taps == 1) {
            axis.sample.push_back(static_cast<std::int64_t>(std::floor(p + 0.5)));
            axis.weight.push_back(1);
            continue;
        }
        const double cell = std::floor(p);
        std::array<double, kMostTaps> weights;
        filter.weights(p - cell, weights.data());
        for (int tap = 0; tap < axis.taps; ++tap) {
            const std::int64_t at = static_cast<std::int64_t>(cell) + 1 - axis.taps / 2 + tap;
            axis.sample.push_back(filter.coefficients ? mirror_of(at, n)
                                                      : std::clamp<std::int64_t>(at, 0, n - 1));
            axis.weight.push_back(static_cast<float>(weights[static_cast<std::size_t>(tap)]));
        }
    }
    return axis;
}

ScaledAxis averaged_axis(std::int64_t n, std::int64_t m) {
    // Voxel s is [s m, (s + 1) m) and cell i [i n, (i + 1) n): whole numbers, so nothing is
    // rounded.
    ScaledAxis axis;
    const auto first = [&](std::int64_t i) { return i * n / m; };
    const auto last = [&](std::int64_t i) { return ((i + 1) * n - 1) / m; };
    for (std::int64_t i = 0; i < m; ++i)
        axis.taps = std::max(axis.taps, static_cast<int>(last(i) - first(i) + 1));
    for (std::int64_t i = 0; i < m; ++i)
        for (int tap = 0; tap < axis.taps; ++tap) {
            const std::int64_t s = first(i) + tap;
            const std::int64_t covered =
                std::min((s + 1) * m, (i + 1) * n) - std::max(s * m, i * n);
            axis.sample.push_back(std::min(s, n - 1));
            axis.weight.push_back(static_cast<float>(
                std::max(0.0, static_cast<double>(covered) / static_cast<double>(n))));
        }
    return axis;
}

Scaling::Scaling(const Grid& volume, std::array<ScaledAxis, 3> axes)
    : volume_(volume), axes_(std::move(axes)) {}

Region Scaling::reads(const Region& box) const noexcept {
    Region read;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const Columns samples = axes_[axis].reads(box.begin[axis], box.end[axis]);
        read.begin[axis] = samples.begin;
        read.end[axis] = samples.end;
    }
    return read;
}

std::size_t Scaling::scratch_floats(const Region& box) const noexcept {
    const Extent from = reads(box).extent();
    return static_cast<std::size_t>((from.y + 1) * from.x);
}

void Scaling::along_z(std::int64_t z, const Region& from, float* plane) const noexcept {
    const ScaledAxis& axis = axes_[2];
    const Extent n = from.extent();
    const auto add = [&](auto sample) {
        using T = decltype(sample);
        for (std::int64_t y = 0; y < n.y; ++y)
            for (int tap = 0; tap < axis.taps; ++tap) {
                const auto at = static_cast<std::size_t>(z * axis.taps + tap);
                const T* row = volume_.as<T>() + axis.sample[at] * volume_.slice_step() +
                               (from.begin[1] + y) * volume_.row_step() + from.begin[0];
                add_row(row, axis.weight[at], n.x, tap == 0, plane + y * n.x);
            }
    };
    if (volume_.type == Type::f16)
        add(HalfFloat{});
    else
        with_type(volume_.type, add);
}

void Scaling::operator()(const Region& box, float* out, std::ptrdiff_t row, std::ptrdiff_t slice,
                         float* scratch) const noexcept {
    const Region from = reads(box);
    const Extent n = from.extent();
    float* const line = scratch + n.y * n.x;
    const auto slope = static_cast<float>(volume_.values.slope);
    const auto offset = static_cast<float>(volume_.values.offset);
    const ScaledAxis &along_x = axes_[0], &along_y = axes_[1];
    for (std::int64_t z = box.begin[2]; z < box.end[2]; ++z) {
        along_z(z, from, scratch);
        for (std::int64_t y = box.begin[1]; y < box.end[1]; ++y) {
            for (int tap = 0; tap < along_y.taps; ++tap) {
                const auto at = static_cast<std::size_t>(y * along_y.taps + tap);
                add_row(scratch + (along_y.sample[at] - from.begin[1]) * n.x, along_y.weight[at],
                        n.x, tap == 0, line);
            }
            float* const made = out + (z - box.begin[2]) * slice + (y - box.begin[1]) * row;
            for (std::int64_t x = box.begin[0]; x < box.end[0]; ++x) {
                const auto first = static_cast<std::size_t>(x * along_x.taps);
                const std::int64_t* sample = along_x.sample.data() + first;
                const float* weight = along_x.weight.data() + first;
                float sum = 0;
                for (int tap = 0; tap < along_x.taps; ++tap)
                    sum += weight[tap] * line[sample[tap] - from.begin[0]];
                made[x - box.begin[0]] = slope * sum + offset;
            }
        }
    }
}

}  // namespace edgewise::kernels
