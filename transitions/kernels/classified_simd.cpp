// Samples of light and transparency, and their composites.
#include <algorithm>
#include <cstdint>

#include "transitions/kernels/classified.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/classified_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/pixel_rules-inl.hpp"
#include "transitions/kernels/sample_rows-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

constexpr std::int64_t kBlock = 256;  // samples of a row that are worked out at once

/// The state of a pixel becomes what one sample is: planes of red, green, blue, transparency. The
/// same operations as OverRule has on a ray that nothing hides.
template <bool kFinite, int kColors>
struct ClassifyRule {
    const Optics& optics;
    float power;

    explicit ClassifyRule(const Combining& with)
        : optics(*with.optics), power(static_cast<float>(with.step / with.optics->unit)) {}

    HWY_INLINE void add(VF value, VF weight, bool, MF none, float* state,
                        std::ptrdiff_t plane) const {
        const DF d;
        VF color[kColors], opacity = look_up<kColors>(optics, value, color);
        if constexpr (!kFinite) {
            opacity = hn::IfThenElseZero(is_finite(value), opacity);
            none = hn::Or(none, hn::Not(is_finite(value)));
        }
        const MF seen = hn::AndNot(none, hn::Gt(opacity, hn::Zero(d)));
        if (!hn::AllFalse(d, seen))
            opacity = corrected(opacity, hn::Mul(weight, hn::Set(d, power)));
        opacity = hn::IfThenElseZero(seen, opacity);
        for (int c = 0; c < kColors; ++c)
            hn::StoreU(hn::IfThenElseZero(seen, hn::Mul(opacity, color[c])), d, state + c * plane);
        hn::StoreU(hn::Sub(hn::Set(d, 1.0f), opacity), d, state + 3 * plane);
    }
};

struct Classify {
    const Combining& with;
    const Grid& volume;
    std::int64_t x, y, z, width;
    const float *low, *high;
    float* out;

    template <class Rule, class Make>
    void run(bool grey, const Make& row_at) const {
        const Rule rule(with);
        HWY_ALIGN float planes[4 * kBlock];
        for (std::int64_t first = 0; first < width; first += kBlock) {
            const std::int64_t n = std::min(kBlock, width - first);
            const std::int64_t from = z * volume.slice_step() + y * volume.row_step() + x + first;
            add_parts(rule, row_at(from), 0, n, static_cast<float>(z), low + first, high + first,
                      planes, kBlock);
            const float *green = planes + (grey ? 0 : kBlock), *blue = green + (grey ? 0 : kBlock);
            for (std::int64_t i = 0; i < n; ++i) {
                float* sample = out + kClassified * (first + i);
                sample[0] = planes[i];
                sample[1] = green[i];
                sample[2] = blue[i];
                sample[3] = planes[3 * kBlock + i];
            }
        }
    }
    template <bool kFinite, class Make>
    void with_colors(const Make& row_at) const {
        if (with.optics->grey)
            run<ClassifyRule<kFinite, 1>>(true, row_at);
        else
            run<ClassifyRule<kFinite, 3>>(false, row_at);
    }
    template <class T>
    void typed() const {
        with_colors<!std::is_same_v<T, float>>(
            [this](std::int64_t first) { return Row<T>{volume.template row_from<T>(first)}; });
    }
};

void classify_row_on(const Combining& with, const Grid& volume, std::int64_t x, std::int64_t y,
                     std::int64_t z, std::int64_t width, const float* low, const float* high,
                     float* out) {
    const Classify row{with, volume, x, y, z, width, low, high, out};
    switch (volume.type) {
        case Type::u8:
            return row.typed<std::uint8_t>();
        case Type::i8:
            return row.typed<std::int8_t>();
        case Type::u16:
            return row.typed<std::uint16_t>();
        case Type::i16:
            return row.typed<std::int16_t>();
        case Type::f32:
            return row.typed<float>();
        default:
            return row.with_colors<false>([&](std::int64_t first) {
                return LoadedRow{volume.samples, scalar_load(volume.type), first};
            });
    }
}

// Vectors hold whole samples. A machine whose vectors are single numbers has plain loops.
#if HWY_TARGET == HWY_SCALAR

template <class Each>
void each_sample(const float* front, const float* behind, float* into, std::int64_t pixels,
                 const Each& each) {
    for (std::int64_t i = 0; i < kClassified * pixels; i += kClassified) {
        const float before = front[i + 3];
        for (int c = 0; c < 3; ++c) into[i + c] = each.light(front[i + c], before, behind[i + c]);
        into[i + 3] = each.left(before, behind[i + 3]);
    }
}

struct Over {
    static float light(float front, float left, float behind) { return front + left * behind; }
    static float left(float front, float behind) { return front * behind; }
};
struct Attenuate {
    static float light(float, float left, float behind) { return left * behind; }
    static float left(float front, float behind) { return front * behind; }
};
struct Add {
    static float light(float front, float, float behind) { return front + behind; }
    static float left(float, float behind) { return behind; }
};

#else

/// Light of samples, 0 in place of transparency.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V light_of(D d, V samples) {
    constexpr std::uint32_t kAll = 0xffffffff;
    alignas(16) constexpr std::uint32_t kLight[4] = {kAll, kAll, kAll, 0};
    return hn::And(samples, hn::BitCast(d, hn::LoadDup128(hn::RebindToUnsigned<D>(), kLight)));
}

/// The last sample is done by itself in a vector of one sample: the same operations.
template <class Each>
void each_sample(const float* front, const float* behind, float* into, std::int64_t pixels,
                 const Each& each) {
    const DF d;
    const hn::CappedTag<float, kClassified> one;
    const std::int64_t n = kClassified * pixels, lanes = static_cast<std::int64_t>(hn::Lanes(d));
    std::int64_t i = 0;
    for (; i + lanes <= n; i += lanes)
        hn::StoreU(each.of(d, hn::LoadU(d, front + i), hn::LoadU(d, behind + i)), d, into + i);
    for (; i < n; i += kClassified)
        hn::StoreU(each.of(one, hn::LoadU(one, front + i), hn::LoadU(one, behind + i)), one,
                   into + i);
}

struct Over {
    template <class D, class V = hn::Vec<D>>
    static HWY_INLINE V of(D d, V front, V behind) {
        return hn::MulAdd(hn::Broadcast<3>(front), behind, light_of(d, front));
    }
};
struct Attenuate {
    template <class D, class V = hn::Vec<D>>
    static HWY_INLINE V of(D, V front, V behind) {
        return hn::Mul(hn::Broadcast<3>(front), behind);
    }
};
struct Add {
    template <class D, class V = hn::Vec<D>>
    static HWY_INLINE V of(D d, V front, V behind) {
        return hn::Add(light_of(d, front), behind);
    }
};

#endif

void over_row_on(const float* front, const float* behind, float* into, std::int64_t pixels) {
    each_sample(front, behind, into, pixels, Over());
}
void attenuate_row_on(const float* front, const float* samples, float* into, std::int64_t pixels) {
    each_sample(front, samples, into, pixels, Attenuate());
}
void add_row_on(const float* front, const float* behind, float* into, std::int64_t pixels) {
    each_sample(front, behind, into, pixels, Add());
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(classify_row_on);
HWY_EXPORT(over_row_on);
HWY_EXPORT(attenuate_row_on);
HWY_EXPORT(add_row_on);

void classify_row(const Combining& with, const Grid& volume, std::int64_t x, std::int64_t y,
                  std::int64_t z, std::int64_t width, const float* low, const float* high,
                  float* out) {
    HWY_DYNAMIC_DISPATCH(classify_row_on)(with, volume, x, y, z, width, low, high, out);
}
void over_row(const float* front, const float* behind, float* into, std::int64_t pixels) {
    HWY_DYNAMIC_DISPATCH(over_row_on)(front, behind, into, pixels);
}
void attenuate_row(const float* front, const float* samples, float* into, std::int64_t pixels) {
    HWY_DYNAMIC_DISPATCH(attenuate_row_on)(front, samples, into, pixels);
}
void add_row(const float* front, const float* behind, float* into, std::int64_t pixels) {
    HWY_DYNAMIC_DISPATCH(add_row_on)(front, behind, into, pixels);
}

}  // namespace edgewise::kernels
#endif
