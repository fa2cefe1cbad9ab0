// Vectors of pixels, and optics on them. Compiled once a target: see Highway's foreach_target.h.
#if defined(EDGEWISE_OPTICS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_OPTICS_INL
#undef EDGEWISE_OPTICS_INL
#else
#define EDGEWISE_OPTICS_INL
#endif

#include <limits>

#include "hwy/contrib/math/math-inl.h"
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

/// 1 - (1 - a)^power, without cancellation for small a (S21).
HWY_NOINLINE VF corrected(VF opacity, VF power) {
    const DF d;
    const VF one = hn::Set(d, 1.0f);
    const MF opaque = hn::Ge(opacity, one);
    const VF below = hn::IfThenZeroElse(opaque, opacity);
    const VF light = hn::Neg(hn::Expm1(d, hn::Mul(power, hn::Log1p(d, hn::Neg(below)))));
    return hn::IfThenElse(opaque, one, light);
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
