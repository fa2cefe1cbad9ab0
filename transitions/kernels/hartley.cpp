#include "transitions/kernels/hartley.hpp"

#include <algorithm>
#include <tbb/parallel_for.h>

#include "transitions/kernels/kaiser_bessel.hpp"
#include "transitions/kernels/spectrum.hpp"
#include "transitions/kernels/spectrum_row.hpp"

namespace edgewise::kernels {
namespace {

std::int64_t opposite(std::int64_t k, std::int64_t n) { return k == 0 ? 0 : n - k; }

/// One row of the transform, without the columns that are repeated.
/// @param own, mirrored  the half rows of (j, k) and (-j, -k), from kx = 0 on
void hartley_row(const Complex* own, const Complex* mirrored, std::int64_t period, float* out) {
    const std::int64_t half = period / 2;
    for (std::int64_t i = 0; i <= half; ++i) out[i] = own[i].real() - own[i].imag();
    // F(-k) is the conjugate of F(k).
    for (std::int64_t i = half + 1; i < period; ++i)
        out[i] = mirrored[period - i].real() + mirrored[period - i].imag();
}

struct HartleyTap {
    std::int64_t index;
    float weights[TapTable::kMostTaps];
};

template <int kWidth>
HartleyTap hartley_tap(std::uint64_t frequency, std::uint64_t period, const float* table) {
    __extension__ using Wide = unsigned __int128;
    constexpr int kRest = 24 - tap_bits(kWidth);
    const Wide at = static_cast<Wide>(frequency) * period + tap_shift(kWidth);
    const auto fraction = static_cast<std::uint64_t>(at) >> 40;  // 24 bits
    const float* low = table + (fraction >> kRest) * TapTable::kMostTaps;
    const float part = static_cast<float>(fraction & ((1u << kRest) - 1)) * (1.f / (1 << kRest));
    HartleyTap tap{static_cast<std::int64_t>(at >> 64), {}};
    for (int i = 0; i < kWidth; ++i)
        tap.weights[i] = low[i] + part * (low[i + TapTable::kMostTaps] - low[i]);
    return tap;
}

/// The sum of width^3 taps from a column on, weighed along y and z.
template <int kWidth>
void columns_of(const float* first, const std::ptrdiff_t* rows, const std::ptrdiff_t* planes,
                const HartleyTap& y, const HartleyTap& z, float* sums) {
    std::fill_n(sums, kWidth, 0.f);
    for (int k = 0; k < kWidth; ++k) {
        float inner[kWidth] = {};
        for (int j = 0; j < kWidth; ++j) {
            const float* row = first + planes[k] + rows[j];
            for (int i = 0; i < kWidth; ++i) inner[i] += y.weights[j] * row[i];
        }
        for (int i = 0; i < kWidth; ++i) sums[i] += z.weights[k] * inner[i];
    }
}

template <int kWidth>
void sample_hartley(const SpectrumView& s, std::array<std::uint64_t, 3> f,
                    const std::array<std::uint64_t, 3>& step, std::int64_t n, Complex* out) {
    for (std::int64_t i = 0; i < n; ++i) {
        const HartleyTap x = hartley_tap<kWidth>(f[0], s.period[0], s.taps);
        const HartleyTap y = hartley_tap<kWidth>(f[1], s.period[1], s.taps);
        const HartleyTap z = hartley_tap<kWidth>(f[2], s.period[2], s.taps);
        for (std::size_t axis = 0; axis < 3; ++axis) f[axis] += step[axis];
        const std::int64_t first = x.index - taps_before(kWidth);
        // The window is even: at -f the taps lie at -k, with the same weights.
        float ahead[kWidth], behind[kWidth];
        columns_of<kWidth>(s.hartley + first, s.rows + y.index, s.planes + z.index, y, z, ahead);
        columns_of<kWidth>(
            s.hartley + static_cast<std::int64_t>(s.period[0]) - first - (kWidth - 1),
            s.rows_back + y.index, s.planes_back + z.index, y, z, behind);
        float at = 0, mirrored = 0;
        for (int tap = 0; tap < kWidth; ++tap) {
            at += x.weights[tap] * ahead[tap];
            mirrored += x.weights[tap] * behind[kWidth - 1 - tap];
        }
        out[i] = {0.5f * (at + mirrored), 0.5f * (mirrored - at)};
    }
}

}  // namespace

void hartley_of_spectrum(const Grid& spectrum, const Extent& period, float* out, const Stop& stop) {
    const std::int64_t row = spectrum.row_step(), plane = spectrum.slice_step();
    const Extent stored = HartleyShape::stored_of(period);
    const Complex* half = spectrum.as<Complex>() + SpectrumShape::kColumnsBefore;
    tbb::parallel_for(std::int64_t{0}, period.z, [&](std::int64_t k) {
        if (stopped(stop)) return;
        for (std::int64_t j = 0; j < period.y; ++j) {
            float* to = out + (k * stored.y + j) * stored.x + HartleyShape::kColumnsBefore;
            hartley_row(half + k * plane + j * row,
                        half + opposite(k, period.z) * plane + opposite(j, period.y) * row,
                        period.x, to);
            std::copy_n(to + period.x - HartleyShape::kColumnsBefore, HartleyShape::kColumnsBefore,
                        to - HartleyShape::kColumnsBefore);
            std::copy_n(to, HartleyShape::kColumnsAfter, to + period.x);
        }
    });
}

void sample_hartley_row(const SpectrumView& spectrum, std::array<std::uint64_t, 3> frequency,
                        std::array<std::uint64_t, 3> step, std::int64_t n, Complex* out) {
    switch (spectrum.width) {
        case 2:
            return sample_hartley<2>(spectrum, frequency, step, n, out);
        case 3:
            return sample_hartley<3>(spectrum, frequency, step, n, out);
        case 4:
            return sample_hartley<4>(spectrum, frequency, step, n, out);
        case 5:
            return sample_hartley<5>(spectrum, frequency, step, n, out);
        case 6:
            return sample_hartley<6>(spectrum, frequency, step, n, out);
        case 7:
            return sample_hartley<7>(spectrum, frequency, step, n, out);
        default:
            return sample_hartley<8>(spectrum, frequency, step, n, out);
    }
}

}  // namespace edgewise::kernels
