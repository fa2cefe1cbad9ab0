// Vectors of pixels, and optics on them. Compiled once a target: see Highway's foreach_target.h.
#if defined(EDGEWISE_OPTICS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_OPTICS_INL
#undef EDGEWISE_OPTICS_INL
#else
#define EDGEWISE_OPTICS_INL
#endif

#include <limits>

#include "hwy/highway.h"
#include "transitions/kernels/optics.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {  // other kernels have names of their own in this namespace

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using MF = hn::Mask<DF>;
inline constexpr std::size_t kLanes = hn::MaxLanes(DF());

/// a + f (b - a)
HWY_INLINE VF between(VF a, VF b, VF f) { return hn::MulAdd(f, hn::Sub(b, a), a); }

HWY_INLINE MF is_finite(VF v) {
    return hn::Le(hn::Abs(v), hn::Set(DF(), std::numeric_limits<float>::max()));
}

/// Opacity and colours (the first kColors of red, green, blue) at stored numbers.
template <int kColors>
HWY_INLINE VF look_up(const Optics& optics, VF value, VF* color) {
    const DF d;
    const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    VF opacity = hn::Set(d, optics.opacity);
    for (int c = 0; c < kColors; ++c) color[c] = hn::Set(d, optics.color[c]);
    for (const OpticsRamp& ramp : optics.ramps) {
        const VF along =
            hn::Mul(hn::Sub(value, hn::Set(d, ramp.start)), hn::Set(d, ramp.inverse_width));
        const VF part = hn::Min(hn::Max(along, zero), one);
        opacity = hn::MulAdd(part, hn::Set(d, ramp.opacity), opacity);
        for (int c = 0; c < kColors; ++c)
            color[c] = hn::MulAdd(part, hn::Set(d, ramp.color[c]), color[c]);
    }
    return hn::Min(hn::Max(opacity, zero), one);
}

/// 1 - (1 - a)^power for 0 <= a <= 1 and power >= 0, without cancellation for small a (S21): the
/// logarithm of 1 - a and the exponential less 1 are polynomials, of relative error 2^-24 (minimax,
/// by Lawson's iteration), around 0 where nothing was rounded yet.
[[maybe_unused]] HWY_NOINLINE VF corrected(VF opacity, VF power) {
    const DF d;
    const DI di;
    const VF one = hn::Set(d, 1.0f);
    const MF opaque = hn::Ge(opacity, one);
    const auto c = [&](float value) HWY_ATTR { return hn::Set(d, value); };

    // 1 - a = 2^k (1 + f) with 1 + f in [sqrt(1/2), sqrt(2)).
    const VI root = hn::Set(di, 0x3f3504f3), bits = hn::BitCast(di, hn::Sub(one, opacity));
    const VI above = hn::Sub(bits, root), exponent = hn::ShiftRight<23>(above);
    const VF mantissa = hn::BitCast(d, hn::Add(hn::And(above, hn::Set(di, 0x007fffff)), root));
    const VF k = hn::ConvertTo(d, exponent);
    const VF f = hn::IfThenElse(hn::Eq(k, hn::Zero(d)), hn::Neg(opacity), hn::Sub(mantissa, one));
    // log(1 + f) = f - f^2 / 2 + f^3 q
    const VF f2 = hn::Mul(f, f), f4 = hn::Mul(f2, f2);
    const VF q01 = hn::MulAdd(f, c(-0.2500133812427521f), c(0.3333390951156616f));
    const VF q23 = hn::MulAdd(f, c(-0.1657758504152298f), c(0.19963063299655914f));
    const VF q45 = hn::MulAdd(f, c(-0.14267486333847046f), c(0.14914768934249878f));
    const VF q46 = hn::MulAdd(f2, c(0.08700434863567352f), q45);
    const VF q = hn::MulAdd(f4, q46, hn::MulAdd(f2, q23, q01));
    const VF tail = hn::Mul(f2, hn::MulAdd(f, q, c(-0.5f)));
    constexpr float kHigh = 0.693359375f, kLow = -2.12194440e-4f;  // ln 2; k kHigh is exact
    const VF log = hn::MulAdd(k, c(kHigh), hn::Add(f, hn::MulAdd(k, c(kLow), tail)));

    // power log = n ln 2 + r; what is left of the light, less 1, is 2^n (exp(r) - 1) + 2^n - 1.
    const VF y = hn::Max(hn::Mul(power, log), c(-87.0f));
    const VF n = hn::Round(hn::Mul(y, c(1.44269504f)));
    const VF r = hn::NegMulAdd(n, c(kLow), hn::NegMulAdd(n, c(kHigh), y));
    // exp(r) - 1 = r + r^2 e
    const VF r2 = hn::Mul(r, r);
    const VF e01 = hn::MulAdd(r, c(0.1666654348373413f), c(0.4999999701976776f));
    const VF e23 = hn::MulAdd(r, c(0.00836651399731636f), c(0.04166720062494278f));
    const VF e24 = hn::MulAdd(r2, c(0.0013882522471249104f), e23);
    const VF less = hn::MulAdd(r2, hn::MulAdd(r2, e24, e01), r);
    const VI biased = hn::Add(hn::ConvertTo(di, n), hn::Set(di, 127));
    const VF scale = hn::BitCast(d, hn::ShiftLeft<23>(biased));
    const VF light = hn::NegMulAdd(scale, less, hn::Sub(one, scale));
    // At its own unit of length an opacity is returned bit for bit: whether a cell is corrected
    // depends on the rays beside it.
    return hn::IfThenElse(hn::Eq(power, one), opacity, hn::IfThenElse(opaque, one, light));
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
