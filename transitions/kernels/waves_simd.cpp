// Damped waves over lines side by side.
#include "transitions/kernels/waves.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/waves_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Lines = hn::CappedTag<float, kWaveLines / 2>;
using Vector = hn::Vec<Lines>;

/// One wave in one vector of lines.
struct State {
    Vector real, imaginary;

    HWY_INLINE void turn(Vector pole_real, Vector pole_imaginary) {
        const Vector was = real;
        real = hn::NegMulAdd(pole_imaginary, imaginary, hn::Mul(pole_real, real));
        imaginary = hn::MulAdd(pole_imaginary, was, hn::Mul(pole_real, imaginary));
    }
    HWY_INLINE void add(Vector amplitude_real, Vector amplitude_imaginary, Vector sample) {
        real = hn::MulAdd(amplitude_real, sample, real);
        imaginary = hn::MulAdd(amplitude_imaginary, sample, imaginary);
    }
};

/// Two vectors of lines at a time, with two waves each: four chains hide the latency of a turn.
template <bool kBackward>
HWY_INLINE void follow(const Waves& waves, const float* in, float* out, std::int64_t n) {
    const Lines d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    const auto pr0 = hn::Set(d, waves.pole_real[0]), pr1 = hn::Set(d, waves.pole_real[1]);
    const auto pi0 = hn::Set(d, waves.pole_imaginary[0]), pi1 = hn::Set(d, waves.pole_imaginary[1]);
    const auto ar0 = hn::Set(d, waves.real[0]), ar1 = hn::Set(d, waves.real[1]);
    const auto ai0 = hn::Set(d, waves.imaginary[0]), ai1 = hn::Set(d, waves.imaginary[1]);
    const std::int64_t first = kBackward ? n - 1 : 0, step = kBackward ? -1 : 1;
    for (std::int64_t l = 0; l < kWaveLines; l += 2 * lanes) {
        const auto begin = [&](int wave, std::int64_t line) {
            const auto sample = hn::LoadU(d, in + first * kWaveLines + line);
            return State{hn::Mul(hn::Set(d, waves.settled_real[wave]), sample),
                         hn::Mul(hn::Set(d, waves.settled_imaginary[wave]), sample)};
        };
        State a0 = begin(0, l), a1 = begin(1, l), b0 = begin(0, l + lanes),
              b1 = begin(1, l + lanes);
        for (std::int64_t k = 0, i = first; k < n; ++k, i += step) {
            const float* from = in + i * kWaveLines + l;
            float* to = out + i * kWaveLines + l;
            const auto a = hn::LoadU(d, from), b = hn::LoadU(d, from + lanes);
            a0.turn(pr0, pi0);
            b0.turn(pr0, pi0);
            a1.turn(pr1, pi1);
            b1.turn(pr1, pi1);
            if constexpr (kBackward) {
                hn::StoreU(hn::Add(hn::LoadU(d, to), hn::Add(a0.real, a1.real)), d, to);
                hn::StoreU(hn::Add(hn::LoadU(d, to + lanes), hn::Add(b0.real, b1.real)), d,
                           to + lanes);
            }
            a0.add(ar0, ai0, a);
            b0.add(ar0, ai0, b);
            a1.add(ar1, ai1, a);
            b1.add(ar1, ai1, b);
            if constexpr (!kBackward) {
                hn::StoreU(hn::Add(a0.real, a1.real), d, to);
                hn::StoreU(hn::Add(b0.real, b1.real), d, to + lanes);
            }
        }
    }
}

void Forward(const Waves& waves, const float* in, float* out, std::int64_t n) {
    follow<false>(waves, in, out, n);
}
void Backward(const Waves& waves, const float* in, float* out, std::int64_t n) {
    follow<true>(waves, in, out, n);
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(Forward);
HWY_EXPORT(Backward);

void waves_forward(const Waves& waves, const float* in, float* out, std::int64_t n) {
    HWY_DYNAMIC_DISPATCH(Forward)(waves, in, out, n);
}
void waves_backward(const Waves& waves, const float* in, float* out, std::int64_t n) {
    HWY_DYNAMIC_DISPATCH(Backward)(waves, in, out, n);
}

}  // namespace edgewise::kernels
#endif
