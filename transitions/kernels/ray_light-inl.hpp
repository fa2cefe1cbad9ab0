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
#include "transitions/kernels/arriving.hpp"
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

/// Trilinear interpolation between the points of a grid, at places in it.
HWY_INLINE VF left_in(const float* left, const Extent& n, const VF (&place)[3]) {
    const DF d;
    const DI di;
    const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    VI cell[3][2];
    VF share[3];
    for (int axis = 0; axis < 3; ++axis) {
        const auto last = static_cast<int>(n[axis] - 1);
        const VF q = hn::Min(hn::Max(place[axis], zero), hn::Set(d, static_cast<float>(last)));
        cell[axis][0] = truncated(q);
        cell[axis][1] = hn::Min(hn::Add(cell[axis][0], hn::Set(di, 1)), hn::Set(di, last));
        share[axis] = hn::Sub(q, hn::ConvertTo(d, cell[axis][0]));
    }
    const VI row = hn::Set(di, static_cast<int>(n.x)), rows = hn::Set(di, static_cast<int>(n.y));
    VF sum = zero;
    for (int corner = 0; corner < 8; ++corner) {
        const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
        VF weight = a ? share[0] : hn::Sub(one, share[0]);
        weight = hn::Mul(weight, b ? share[1] : hn::Sub(one, share[1]));
        weight = hn::Mul(weight, c ? share[2] : hn::Sub(one, share[2]));
        const VI line = hn::Add(cell[1][b], hn::Mul(cell[2][c], rows));
        const VI at = hn::Add(cell[0][a], hn::Mul(line, row));
        sum = hn::MulAdd(weight, hn::GatherIndex(d, left, at), sum);
    }
    return sum;
}

/// The shares of light that arrive at places of the input.
struct ArrivingLanes {
    VF lights[Arriving::kMostLights];
    VF ambient;

    ArrivingLanes() : ambient(hn::Set(DF(), 1.0f)) {
        for (VF& light : lights) light = ambient;
    }
    HWY_NOINLINE void find(const RayArriving& in, const VF (&p)[3]) {
        const DF d;
        VF place[3];
        for (std::size_t i = 0; i < in.lights.size(); ++i) {
            const LightGrid& grid = *in.lights[i];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const double* m = grid.to_grid.data() + 4 * axis;
                const auto set = [&](double number)
                                     HWY_ATTR { return hn::Set(d, static_cast<float>(number)); };
                place[axis] =
                    hn::MulAdd(set(m[0]), p[0],
                               hn::MulAdd(set(m[1]), p[1], hn::MulAdd(set(m[2]), p[2], set(m[3]))));
            }
            lights[i] = left_in(grid.left.data(), grid.extent, place);
        }
        if (!in.ambient) return;
        const VF half = hn::Set(d, 0.5f);
        for (std::size_t axis = 0; axis < 3; ++axis)
            place[axis] =
                hn::MulSub(hn::Add(p[axis], half),
                           hn::Set(d, 1.0f / static_cast<float>(in.ambient->cell[axis])), half);
        ambient = left_in(in.ambient->left.data(), in.ambient->extent, place);
    }
};

/// Shading::at of particles.
[[maybe_unused]] HWY_NOINLINE void scattered_on(const RayLight& by, const VF3& eye,
                                                const ArrivingLanes& arriving, VF& diffuse,
                                                VF& specular) {
    const DF d;
    const float g = by.phase;
    diffuse = specular = hn::Zero(d);
    for (std::size_t i = 0; i < by.sources.size(); ++i) {
        const RayLight::Source& source = by.sources[i];
        VF towards[3];
        for (int axis = 0; axis < 3; ++axis) towards[axis] = hn::Set(d, source.towards[axis]);
        // 1 + g^2 - 2 g cos, in a form that does not cancel where g is near 1 or -1.
        const VF turned = hn::Set(d, g < 0 ? -1.0f : 1.0f);
        const VF away =
            hn::Max(hn::Zero(d), hn::MulAdd(turned, dot(towards, eye), hn::Set(d, 1.0f)));
        const VF base = hn::MulAdd(hn::Set(d, 2 * std::abs(g)), away, hn::Set(d, by.phase_least));
        const VF whole = hn::Mul(base, hn::Sqrt(base));
        const VF sent = hn::Div(hn::Set(d, source.intensity * by.phase_share), whole);
        diffuse = i < Arriving::kMostLights ? hn::MulAdd(arriving.lights[i], sent, diffuse)
                                            : hn::Add(sent, diffuse);
    }
}

/// A gradient of stored numbers by input index -> of values in screen space.
[[maybe_unused]] HWY_INLINE void to_screen(const RayLight& by, const VF3& gradient, VF3& seen) {
    const DF d;
    for (int row = 0; row < 3; ++row) {
        const float* m = by.to_screen.data() + 3 * row;
        seen[row] = hn::MulAdd(
            hn::Set(d, m[0]), gradient[0],
            hn::MulAdd(hn::Set(d, m[1]), gradient[1], hn::Mul(hn::Set(d, m[2]), gradient[2])));
    }
}

/// Shading::at, operation for operation.
/// @param eye  to the eye, unit length
[[maybe_unused]] HWY_NOINLINE void light_on(const RayLight& by, const VF3& gradient, const VF3& eye,
                                            const ArrivingLanes& arriving, VF& diffuse,
                                            VF& specular) {
    const DF d;
    const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    if (by.by == Shade::particles) return scattered_on(by, eye, arriving, diffuse, specular);
    VF normal[3];
    to_screen(by, gradient, normal);
    const VF length = hn::Sqrt(dot(normal, normal));
    const MF some = hn::And(hn::Gt(length, zero), is_finite(length));
    const VF inverse = hn::IfThenElseZero(some, hn::Div(one, length));
    for (VF& axis : normal) axis = hn::IfThenElseZero(some, hn::Mul(axis, inverse));
    const VF towards_eye = dot(normal, eye), facing_eye = hn::Abs(towards_eye);
    const VF half_way = hn::Set(d, 0.5f), edge_on = hn::Set(d, float{0.5 / Shading::kEdgeOn});
    const VF surface = hn::Min(one, hn::Mul(length, hn::Set(d, 1 / by.least)));
    diffuse = zero;
    specular = zero;
    for (std::size_t i = 0; i < by.sources.size(); ++i) {
        const RayLight::Source& source = by.sources[i];
        VF towards[3];
        for (int axis = 0; axis < 3; ++axis) towards[axis] = hn::Set(d, source.towards[axis]);
        // Of the side that the light falls on.
        const VF along_light = dot(normal, towards), along = dot(towards, eye);
        const VF turned = hn::And(along_light, hn::Set(d, -0.0f));
        const VF facing = hn::Abs(along_light), to_eye = hn::Xor(towards_eye, turned);
        const VF seen = hn::Min(one, hn::Max(zero, hn::MulAdd(edge_on, to_eye, half_way)));
        VF strength = hn::Mul(seen, hn::Set(d, source.intensity));
        if (i < Arriving::kMostLights) strength = hn::Mul(strength, arriving.lights[i]);
        diffuse = hn::MulAdd(strength, facing, diffuse);
        VF sent;
        if (by.by == Shade::phong) {
            const VF cosine = hn::MulSub(hn::Add(facing, facing), to_eye, along);
            sent = hn::Mul(hn::Set(d, by.specular), raised(hn::Max(zero, cosine), by.exponent));
        } else {
            // Half of the way from light to eye; both against each other have none.
            VF half[3];
            for (int axis = 0; axis < 3; ++axis) half[axis] = hn::Add(towards[axis], eye[axis]);
            const VF to_half = hn::Div(one, hn::Sqrt(hn::Max(dot(half, half), hn::Set(d, 1e-20f))));
            const VF nh = hn::Mul(hn::Xor(dot(normal, half), turned), to_half),
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
    const VF ambient = hn::Mul(arriving.ambient, hn::Set(d, by.ambient));
    diffuse = hn::MulAdd(hn::Mul(surface, hn::Set(d, by.diffuse)), diffuse, ambient);
    // Where there is no surface its share may be no number.
    diffuse = hn::IfThenElse(some, diffuse, ambient);
    specular = hn::IfThenElseZero(some, hn::Mul(surface, specular));
}

/// What light adds to samples of sums (Shading::of_sums), in values.
/// @param gradient  of stored numbers by input index
[[maybe_unused]] HWY_NOINLINE VF added_by(const RayLight& by, const VF3& gradient) {
    const DF d;
    VF slope[3];
    to_screen(by, gradient, slope);
    const VF length = hn::Sqrt(dot(slope, slope));
    VF light = hn::Zero(d);
    for (const RayLight::Source& source : by.sources) {
        VF towards[3];
        for (int axis = 0; axis < 3; ++axis) towards[axis] = hn::Set(d, -source.towards[axis]);
        const VF along = dot(slope, towards);
        const VF sent = by.by == Shade::hemisphere
                            ? hn::Mul(hn::Set(d, 0.5f), hn::Add(length, along))
                            : hn::Max(hn::Zero(d), along);
        light = hn::MulAdd(hn::Set(d, source.intensity), sent, light);
    }
    return hn::IfThenElseZero(is_finite(length), hn::Mul(hn::Set(d, by.diffuse), light));
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
HWY_NOINLINE void central(const Bounds& bounds, const Sampler& sampler, VF x, VF y, VF z, VF value,
                          VF3& gradient) {
    const VF one = hn::Set(DF(), 1.0f);
    MF known = hn::FirstN(DF(), 0);
    if constexpr (requires { sampler.differences(x, y, z, gradient); }) {
        known = sampler.differences(x, y, z, gradient);
        // Samples that are not finite spoil what is worked out at once.
        if constexpr (!kFinite)
            known =
                hn::And(known, is_finite(hn::Add(gradient[0], hn::Add(gradient[1], gradient[2]))));
        if (hn::AllTrue(DF(), known)) return;
    }
    x = bounds.clamped(x, 0);
    y = bounds.clamped(y, 1);
    z = bounds.clamped(z, 2);
    const auto at = [&](VF i, VF j, VF k) HWY_ATTR { return sampler.template at<false>(i, j, k); };
    const VF each[3] = {
        difference<kFinite>(at(hn::Sub(x, one), y, z), value, at(hn::Add(x, one), y, z)),
        difference<kFinite>(at(x, hn::Sub(y, one), z), value, at(x, hn::Add(y, one), z)),
        difference<kFinite>(at(x, y, hn::Sub(z, one)), value, at(x, y, hn::Add(z, one)))};
    for (int axis = 0; axis < 3; ++axis)
        gradient[axis] = hn::IfThenElse(known, gradient[axis], each[axis]);
}

/// The factor of opacities by the length of a gradient of stored numbers.
[[maybe_unused]] HWY_INLINE VF edge_of(const RayEdges& edges, const VF3& gradient) {
    const DF d;
    VF square = hn::Zero(d);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const VF along = hn::Mul(gradient[axis], hn::Set(d, edges.per_length[axis]));
        square = hn::MulAdd(along, along, square);
    }
    const VF length = hn::Sqrt(square), zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    VF factor = hn::Set(d, edges.first);
    for (const OpticsRamp& ramp : edges.ramps) {
        const VF along =
            hn::Mul(hn::Sub(length, hn::Set(d, ramp.start)), hn::Set(d, ramp.inverse_width));
        factor = hn::MulAdd(hn::Min(hn::Max(along, zero), one), hn::Set(d, ramp.opacity), factor);
    }
    return hn::Min(hn::Max(factor, zero), one);
}

/// The same by Sobel's operator (GradientScheme::sobel). Of trilinear samples that is what
/// trilinear interpolation of the operator's own results gives.
template <bool kFinite, class Sampler>
HWY_NOINLINE void sobel(const Bounds& bounds, const Sampler& sampler, VF x, VF y, VF z, VF value,
                        VF3& gradient) {
    const DF d;
    x = bounds.clamped(x, 0);
    y = bounds.clamped(y, 1);
    z = bounds.clamped(z, 2);
    MF known = hn::FirstN(d, 0);
    if constexpr (requires { sampler.sobel(x, y, z, gradient); }) {
        sampler.sobel(x, y, z, gradient);
        if constexpr (kFinite) return;
        // Samples that are not finite spoil what is worked out at once.
        known = is_finite(hn::Add(gradient[0], hn::Add(gradient[1], gradient[2])));
        if (hn::AllTrue(d, known)) return;
    }
    VF sums[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for (int place = 0; place < 27; ++place) {
        const int at[3] = {place % 3 - 1, place / 3 % 3 - 1, place / 9 - 1};
        const auto smooth = [&](int axis) { return static_cast<float>(2 - std::abs(at[axis])); };
        const auto moved = [&](VF p, int axis) HWY_ATTR {
            return hn::Add(p, hn::Set(d, static_cast<float>(at[axis])));
        };
        if (place == 13) continue;  // the place itself
        VF there = sampler.template at<false>(moved(x, 0), moved(y, 1), moved(z, 2));
        if constexpr (!kFinite) there = hn::IfThenElse(is_finite(there), there, value);
        for (int axis = 0; axis < 3; ++axis) {
            const float weight =
                static_cast<float>(at[axis]) * smooth((axis + 1) % 3) * smooth((axis + 2) % 3) / 32;
            sums[axis] = hn::MulAdd(hn::Set(d, weight), there, sums[axis]);
        }
    }
    for (int axis = 0; axis < 3; ++axis)
        gradient[axis] = hn::IfThenElse(known, gradient[axis], sums[axis]);
}

/// What light is left of, by depth, for the rays of a packet.
struct Fading {
    VF depth, deeper;  // of the middle of a ray's first cell, and from one cell to the next
    float per_length = 0;
    bool linear = false;

    HWY_INLINE VF at(VF offset) const {
        const DF d;
        const VF along = hn::Mul(hn::Set(d, per_length), hn::MulAdd(offset, deeper, depth));
        if (linear) return hn::Max(hn::Zero(d), hn::Sub(hn::Set(d, 1.0f), along));
        return hn::Exp(d, hn::Max(hn::Neg(along), hn::Set(d, -80.0f)));
    }
};

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
    if (cast.sobel)
        return sobel<kFinite>(Bounds(cast.volume.extent), sampler, x, y, z, value, gradient);
    if constexpr (requires { sampler.gradient(x, y, z, gradient); })
        sampler.gradient(x, y, z, gradient);
    else
        central<kFinite>(Bounds(cast.volume.extent), sampler, x, y, z, value, gradient);
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
