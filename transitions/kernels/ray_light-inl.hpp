// Light on vectors of samples. Compiled once a target: see Highway's foreach_target.h.
#if defined(EDGEWISE_RAY_LIGHT_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_RAY_LIGHT_INL
#undef EDGEWISE_RAY_LIGHT_INL
#else
#define EDGEWISE_RAY_LIGHT_INL
#endif

#include <cmath>
#include <cstdint>

#include "hwy/contrib/math/math-inl.h"
#include "hwy/highway.h"
#include "transitions/kernels/optics-inl.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_light.hpp"
#include "transitions/kernels/ray_samplers-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// Vectors in screen space.
using VF3 = VF[3];

HWY_INLINE VF dot(const VF3& a, const VF3& b) {
    return hn::MulAdd(a[0], b[0], hn::MulAdd(a[1], b[1], hn::Mul(a[2], b[2])));
}

/// x >= 0 to a power of at least 1.
HWY_INLINE VF raised(VF x, float power) {
    const DF d;
    if (power == std::floor(power)) {
        VF product = hn::Set(d, 1.0f);
        for (auto left = static_cast<std::uint32_t>(power); left > 0; left >>= 1) {
            if (left & 1) product = hn::Mul(product, x);
            x = hn::Mul(x, x);
        }
        return product;
    }
    const VF least = hn::Set(d, 1e-30f);
    return hn::Exp(d, hn::Mul(hn::Set(d, power), hn::Log(d, hn::Max(x, least))));
}

/// Shading::at, operation for operation.
/// @param eye  to the eye, unit length
[[maybe_unused]] HWY_NOINLINE void light_on(const RayLight& by, const VF3& gradient, const VF3& eye,
                                            VF& diffuse, VF& specular) {
    const DF d;
    const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    VF normal[3];
    for (int row = 0; row < 3; ++row) {
        const float* m = by.to_screen.data() + 3 * row;
        normal[row] = hn::MulAdd(
            hn::Set(d, m[0]), gradient[0],
            hn::MulAdd(hn::Set(d, m[1]), gradient[1], hn::Mul(hn::Set(d, m[2]), gradient[2])));
    }
    const VF length = hn::Sqrt(dot(normal, normal));
    const MF some = hn::And(hn::Gt(length, zero), is_finite(length));
    const VF inverse = hn::IfThenElseZero(some, hn::Div(one, length));
    for (VF& axis : normal) axis = hn::IfThenElseZero(some, hn::Mul(axis, inverse));
    const VF seen = dot(normal, eye);
    for (VF& axis : normal) axis = hn::Xor(axis, hn::And(seen, hn::Set(d, -0.0f)));
    const VF facing_eye = hn::Abs(seen);
    const VF surface = hn::Min(one, hn::Mul(length, hn::Set(d, 1 / by.least)));
    diffuse = zero;
    specular = zero;
    for (const RayLight::Source& source : by.sources) {
        VF towards[3];
        for (int axis = 0; axis < 3; ++axis) towards[axis] = hn::Set(d, source.towards[axis]);
        const VF strength = hn::Set(d, source.intensity);
        const VF facing = hn::Max(zero, dot(normal, towards)), along = dot(towards, eye);
        diffuse = hn::MulAdd(strength, facing, diffuse);
        VF sent;
        if (!by.facets) {
            const VF cosine = hn::MulSub(hn::Add(facing, facing), facing_eye, along);
            sent = hn::Mul(hn::Set(d, by.specular), raised(hn::Max(zero, cosine), by.exponent));
        } else {
            // Half of the way from light to eye; both against each other have none.
            VF half[3];
            for (int axis = 0; axis < 3; ++axis) half[axis] = hn::Add(towards[axis], eye[axis]);
            const VF to_half = hn::Div(one, hn::Sqrt(hn::Max(dot(half, half), hn::Set(d, 1e-20f))));
            const VF nh = hn::Mul(dot(normal, half), to_half),
                     vh = hn::Mul(dot(eye, half), to_half);
            const VF cosine = hn::Mul(nh, nh);
            const VF slope =
                hn::Mul(hn::Div(hn::Sub(cosine, one), cosine), hn::Set(d, by.inverse_square));
            const VF facets =
                hn::Div(hn::Exp(d, hn::Max(slope, hn::Set(d, -80.0f))), hn::Mul(cosine, cosine));
            const VF twice = hn::Div(hn::Add(nh, nh), vh);
            const VF shadows = hn::Min(one, hn::Mul(twice, hn::Min(facing_eye, facing)));
            const VF away = hn::Sub(one, vh), away2 = hn::Mul(away, away);
            const VF reflected =
                hn::MulAdd(hn::Set(d, 1 - by.specular), hn::Mul(hn::Mul(away2, away2), away),
                           hn::Set(d, by.specular));
            const MF sends =
                hn::And(hn::And(hn::Gt(nh, zero), hn::Gt(vh, zero)), hn::Gt(facing_eye, zero));
            const VF left = hn::Max(
                zero, hn::NegMulAdd(hn::Set(d, by.diffuse), facing, hn::Set(d, 1 - by.ambient)));
            sent = hn::Min(left, hn::Div(hn::Mul(hn::Mul(reflected, facets), shadows), facing_eye));
            sent = hn::IfThenElseZero(sends, sent);
        }
        sent = hn::IfThenElseZero(hn::Gt(facing, zero), sent);
        specular = hn::MulAdd(strength, sent, specular);
    }
    diffuse = hn::MulAdd(hn::Mul(surface, hn::Set(d, by.diffuse)), diffuse, hn::Set(d, by.ambient));
    // Where there is no surface its share may be no number.
    diffuse = hn::IfThenElse(some, diffuse, hn::Set(d, by.ambient));
    specular = hn::IfThenElseZero(some, hn::Mul(surface, specular));
}

/// Neighbours that are not finite are taken for the sample itself.
template <bool kFinite>
HWY_INLINE VF difference(VF below, VF here, VF above) {
    if constexpr (!kFinite) {
        below = hn::IfThenElse(is_finite(below), below, here);
        above = hn::IfThenElse(is_finite(above), above, here);
    }
    return hn::Mul(hn::Set(DF(), 0.5f), hn::Sub(above, below));
}

/// The gradient of stored numbers by central differences of a sampler's values, one sample to
/// either side (EQ 57). Of trilinear samples that is what trilinear interpolation of the samples'
/// central differences gives.
template <bool kFinite, class Sampler>
HWY_NOINLINE void central(const Sampler& sampler, VF x, VF y, VF z, VF value, VF3& gradient) {
    const VF one = hn::Set(DF(), 1.0f);
    const auto at = [&](VF i, VF j, VF k) HWY_ATTR { return sampler.template at<false>(i, j, k); };
    gradient[0] = difference<kFinite>(at(hn::Sub(x, one), y, z), value, at(hn::Add(x, one), y, z));
    gradient[1] = difference<kFinite>(at(x, hn::Sub(y, one), z), value, at(x, hn::Add(y, one), z));
    gradient[2] = difference<kFinite>(at(x, y, hn::Sub(z, one)), value, at(x, y, hn::Add(z, one)));
}

/// Trilinear interpolation of gradients that were worked out before.
HWY_NOINLINE inline void gradient_beside(const RayCast& cast, VF x, VF y, VF z, VF3& gradient) {
    const DF d;
    const DI di;
    const Bounds bounds(cast.volume.extent);
    const VI one = hn::Set(di, 1);
    const VF p[3] = {bounds.clamped(x, 0), bounds.clamped(y, 1), bounds.clamped(z, 2)};
    VI cell[3][2];
    VF share[3][2];
    for (int axis = 0; axis < 3; ++axis) {
        cell[axis][0] = truncated(p[axis]);
        cell[axis][1] = hn::Min(hn::Add(cell[axis][0], one), bounds.last[axis]);
        share[axis][1] = hn::Sub(p[axis], hn::ConvertTo(d, cell[axis][0]));
        share[axis][0] = hn::Sub(hn::Set(d, 1.0f), share[axis][1]);
    }
    const auto* const words = reinterpret_cast<const int*>(cast.gradients->data());
    const VI row = hn::Set(di, static_cast<int>(cast.volume.extent.x)),
             rows = hn::Set(di, static_cast<int>(cast.volume.extent.y));
    for (VF& axis : gradient) axis = hn::Zero(d);
    for (int corner = 0; corner < 8; ++corner) {
        const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
        const VI line = hn::Add(cell[1][b], hn::Mul(cell[2][c], rows));
        const VI at = hn::ShiftLeft<1>(hn::Add(cell[0][a], hn::Mul(line, row)));
        const VF weight = hn::Mul(hn::Mul(share[0][a], share[1][b]), share[2][c]);
        const VI first = hn::GatherIndex(di, words, at),
                 second = hn::GatherIndex(di, words, hn::Add(at, one));
        const auto low = [&](VI word) HWY_ATTR {
            return hn::ConvertTo(d, hn::ShiftRight<16>(hn::ShiftLeft<16>(word)));
        };
        gradient[0] = hn::MulAdd(weight, low(first), gradient[0]);
        gradient[1] = hn::MulAdd(weight, hn::ConvertTo(d, hn::ShiftRight<16>(first)), gradient[1]);
        gradient[2] = hn::MulAdd(weight, low(second), gradient[2]);
    }
    for (VF& axis : gradient) axis = hn::Mul(axis, hn::Set(d, cast.gradients->scale));
}

/// The gradient as a sampler's filter has it: its derivative, or for those of zero and first order,
/// which have none between their cells, central differences.
/// Where they were worked out before, of these.
template <bool kFinite, class Sampler>
HWY_INLINE void gradient_of(const RayCast& cast, const Sampler& sampler, VF x, VF y, VF z, VF value,
                            VF3& gradient) {
    if (cast.gradients) return gradient_beside(cast, x, y, z, gradient);
    if constexpr (requires { sampler.gradient(x, y, z, gradient); })
        sampler.gradient(x, y, z, gradient);
    else
        central<kFinite>(sampler, x, y, z, value, gradient);
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
