#include "transitions/kernels/kaiser_bessel.hpp"
#include "transitions/kernels/spectrum_row.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/spectrum_row_simd.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway demands.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

__extension__ typedef unsigned __int128 Wide;

/// A frequency as the sample before it and the row of the tap table.
struct Tap {
    std::int64_t index;
    const float* weights;  // row of the table; the next one follows
    float part;            // way to the next row
};

template <int kWidth>
HWY_INLINE Tap tap_at(std::uint64_t frequency, std::uint64_t period, const float* table,
                      std::size_t row) {
    constexpr int kRest = 24 - tap_bits(kWidth);
    const Wide at = static_cast<Wide>(frequency) * period + tap_shift(kWidth);
    const auto fraction = static_cast<std::uint64_t>(at) >> 40;  // 24 bits
    return {static_cast<std::int64_t>(at >> 64), table + (fraction >> kRest) * row,
            static_cast<float>(fraction & ((1u << kRest) - 1)) * (1.f / (1 << kRest))};
}

template <class D>
HWY_INLINE hn::Vec<D> weights_at(D d, const Tap& tap, std::size_t first, std::size_t row) {
    const auto low = hn::LoadU(d, tap.weights + first);
    const auto high = hn::LoadU(d, tap.weights + row + first);
    return hn::MulAdd(hn::Set(d, tap.part), hn::Sub(high, low), low);
}

/// The weights of up to eight taps as single numbers, to be spread over vectors.
template <int kWidth>
HWY_INLINE void spread_weights(const Tap& tap, float* HWY_RESTRICT out) {
    const hn::CappedTag<float, 4> d;
    for (std::size_t i = 0; i < (kWidth + 3) / 4 * 4; i += hn::Lanes(d))
        hn::StoreU(weights_at(d, tap, i, TapTable::kMostTaps), d, out + i);
}

template <int kWidth>
void sample(const SpectrumView& s, std::array<std::uint64_t, 3> f,
            const std::array<std::uint64_t, 3>& step, std::int64_t n, Complex* out) {
    // Fewer taps than four are read as four, others as eight: the last weights are 0, and the
    // columns behind the half spectrum are wide enough.
    constexpr std::size_t kSpan = 2 * columns_read(kWidth);
    constexpr std::size_t kPairs = 2 * TapTable::kMostTaps;
    const hn::CappedTag<float, kSpan> d;
    HWY_ALIGN float wy[8], wz[8], sums[16];
    const auto mirror = [](std::uint64_t v, std::uint64_t sign) { return (v ^ sign) - sign; };
    for (std::int64_t i = 0; i < n; ++i) {
        // F(-f) is the conjugate of F(f): only kx >= 0 is stored.
        const std::uint64_t sign = std::uint64_t{0} - (f[0] >> 63);
        const Tap x = tap_at<kWidth>(mirror(f[0], sign), s.period[0], s.pairs, kPairs);
        const Tap y = tap_at<kWidth>(mirror(f[1], sign), s.period[1], s.taps, TapTable::kMostTaps);
        const Tap z = tap_at<kWidth>(mirror(f[2], sign), s.period[2], s.taps, TapTable::kMostTaps);
        for (int axis = 0; axis < 3; ++axis) f[axis] += step[axis];
        spread_weights<kWidth>(y, wy);
        spread_weights<kWidth>(z, wz);
        const auto* first =
            reinterpret_cast<const float*>(s.samples + x.index - taps_before(kWidth));
        const std::ptrdiff_t* rows = s.rows + y.index;
        const std::ptrdiff_t* planes = s.planes + z.index;
        for (std::size_t part = 0; part < kSpan; part += hn::Lanes(d)) {
            auto sum = hn::Zero(d);
            for (int k = 0; k < kWidth; ++k) {
                const float* plane = first + 2 * planes[k] + part;
                auto inner = hn::Mul(hn::Set(d, wy[0]), hn::LoadU(d, plane + 2 * rows[0]));
                for (int j = 1; j < kWidth; ++j)
                    inner = hn::MulAdd(hn::Set(d, wy[j]), hn::LoadU(d, plane + 2 * rows[j]), inner);
                sum = hn::MulAdd(hn::Set(d, wz[k]), inner, sum);
            }
            hn::StoreU(hn::Mul(sum, weights_at(d, x, part, kPairs)), d, sums + part);
        }
        float re = 0, im = 0;
        for (int tap = 0; tap < kWidth; ++tap) re += sums[2 * tap], im += sums[2 * tap + 1];
        out[i] = {re, sign ? -im : im};
    }
}

void SampleRow(const SpectrumView& spectrum, std::array<std::uint64_t, 3> frequency,
               std::array<std::uint64_t, 3> step, std::int64_t n, Complex* out) {
    switch (spectrum.width) {
        case 2:
            return sample<2>(spectrum, frequency, step, n, out);
        case 3:
            return sample<3>(spectrum, frequency, step, n, out);
        case 4:
            return sample<4>(spectrum, frequency, step, n, out);
        case 5:
            return sample<5>(spectrum, frequency, step, n, out);
        case 6:
            return sample<6>(spectrum, frequency, step, n, out);
        case 7:
            return sample<7>(spectrum, frequency, step, n, out);
        default:
            return sample<8>(spectrum, frequency, step, n, out);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(SampleRow);

void sample_row(const SpectrumView& spectrum, std::array<std::uint64_t, 3> frequency,
                std::array<std::uint64_t, 3> step, std::int64_t n, Complex* out) {
    HWY_DYNAMIC_DISPATCH(SampleRow)(spectrum, frequency, step, n, out);
}

}  // namespace edgewise::kernels
#endif
