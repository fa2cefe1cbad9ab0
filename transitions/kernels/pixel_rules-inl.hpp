// Rules on rows of pixel states (combine.hpp). Compiled once a target: see Highway's
// foreach_target.h.
#if defined(EDGEWISE_PIXEL_RULES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_PIXEL_RULES_INL
#undef EDGEWISE_PIXEL_RULES_INL
#else
#define EDGEWISE_PIXEL_RULES_INL
#endif

#include <limits>
#include <type_traits>

#include "hwy/highway.h"
#include "transitions/kernels/combine.hpp"
#include "transitions/kernels/optics-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {  // other kernels have names of their own in this namespace

constexpr int kBlockPlanes = 32;  // planes summed before they join the total, against rounding

/// Reads kLanes neighbouring numbers of any type that has 8, 16 or 32 bits, as f32.
template <class T>
HWY_INLINE VF load_row(const T* row) {
    if constexpr (std::is_same_v<T, float>) {
        return hn::LoadU(DF(), row);
    } else {
        const hn::Rebind<T, DI> narrow;
        return hn::ConvertTo(DF(), hn::PromoteTo(DI(), hn::LoadU(narrow, row)));
    }
}

// A rule advances the state of a vector of pixels by one sample: `plane` are its planes there.
// kFinite: numbers that need no test. Lanes of `none` get no sample.

template <bool kFinite>
struct MaxRule {
    VF sign;

    explicit MaxRule(const Combining& with)
        : sign(hn::Set(DF(), with.values.slope < 0 ? -0.0f : 0.0f)) {}

    HWY_INLINE void add(VF value, VF, bool, MF none, float* state, std::ptrdiff_t) const {
        const VF best = hn::LoadU(DF(), state);
        VF larger = hn::Max(best, hn::Xor(value, sign));
        if constexpr (!kFinite) larger = hn::IfThenElse(is_finite(value), larger, best);
        hn::StoreU(hn::IfThenElse(none, best, larger), DF(), state);
    }
};

template <bool kFinite>
struct LineRule {
    VF origin;

    explicit LineRule(const Combining& with)
        : origin(hn::Set(DF(), origin_of_sums(with.rule, with.values, with.zero))) {}

    HWY_INLINE void add(VF value, VF weight, bool, MF none, float* state,
                        std::ptrdiff_t plane) const {
        const DF d;
        weight = hn::IfThenZeroElse(none, weight);
        value = hn::Sub(value, origin);
        if constexpr (!kFinite) {
            const MF finite = is_finite(value);
            weight = hn::IfThenElseZero(finite, weight);
            value = hn::IfThenElseZero(finite, value);
        }
        hn::StoreU(hn::MulAdd(weight, value, hn::LoadU(d, state + plane)), d, state + plane);
        float* length = state + 2 * plane;
        hn::StoreU(hn::Add(hn::LoadU(d, length), weight), d, length);
    }
};

template <bool kFinite, int kColors>
struct OverRule {
    const Optics& optics;
    VF bound;
    float power;
    bool exact;

    explicit OverRule(const Combining& with)
        : optics(*with.optics),
          bound(hn::Set(DF(), static_cast<float>(with.bound))),
          power(static_cast<float>(with.step / with.optics->unit)),
          exact(with.step == with.optics->unit) {}

    HWY_INLINE void add(VF value, VF weight, bool whole, MF none, float* state,
                        std::ptrdiff_t plane) const {
        const DF d;
        VF color[kColors], opacity = look_up<kColors>(optics, value, color);
        VF left = hn::LoadU(d, state + 3 * plane);
        if (!whole || !exact) {
            if (hn::AllFalse(d, hn::Gt(hn::Mul(left, opacity), hn::Zero(d)))) return;
            opacity = corrected(opacity, hn::Mul(weight, hn::Set(d, power)));
        }
        if constexpr (!kFinite) opacity = hn::IfThenElseZero(is_finite(value), opacity);
        const VF caught = hn::Mul(left, hn::IfThenZeroElse(none, opacity));
        for (int c = 0; c < kColors; ++c) {
            float* light = state + c * plane;
            hn::StoreU(hn::MulAdd(caught, color[c], hn::LoadU(d, light)), d, light);
        }
        left = hn::Sub(left, caught);
        hn::StoreU(hn::IfThenElseZero(hn::Ge(left, bound), left), d, state + 3 * plane);
    }
};

/// A mode without vectors of its own.
struct OtherRule {
    const RayRule& rule;
    RayRule::Setting setting;

    explicit OtherRule(const Combining& with) : rule(*with.other), setting(setting_of(with)) {}

    HWY_INLINE void add(VF value, VF weight, bool, MF none, float* state,
                        std::ptrdiff_t plane) const {
        HWY_ALIGN float stored[kLanes], weights[kLanes];
        hn::Store(value, DF(), stored);
        hn::Store(hn::IfThenZeroElse(none, weight), DF(), weights);
        rule.add(setting, stored, weights, state, plane, static_cast<int>(kLanes));
    }
};

/// Joins the sums of a block of planes to the totals: after every kBlockPlanes planes.
HWY_INLINE void close_block(float* state, std::ptrdiff_t plane, std::int64_t n) {
    const DF d;
    for (std::int64_t i = 0; i < n; i += kLanes) {
        hn::StoreU(hn::Add(hn::LoadU(d, state + i), hn::LoadU(d, state + plane + i)), d, state + i);
        hn::StoreU(hn::Zero(d), d, state + plane + i);
    }
}

/// Lanes from n on.
HWY_INLINE MF beyond(std::int64_t n) {
    return hn::Not(hn::FirstN(DF(), static_cast<std::size_t>(std::min<std::int64_t>(n, kLanes))));
}

// A source gives values: at(i, n) those of pixels i to i + n, and anything in the lanes beyond.

/// Adds pixels [from, to) of one plane, which count in full.
template <class Rule, class Source>
HWY_INLINE void add_whole(const Rule& rule, const Source& source, std::int64_t from,
                          std::int64_t to, float* state, std::ptrdiff_t plane) {
    const VF one = hn::Set(DF(), 1.0f);
    const MF all = hn::FirstN(DF(), 0);
    std::int64_t i = from;
    for (; i + static_cast<std::int64_t>(kLanes) <= to; i += kLanes)
        rule.add(source.at(i, kLanes), one, true, all, state + i, plane);
    if (i < to) rule.add(source.at(i, to - i), one, true, beyond(to - i), state + i, plane);
}

/// Adds pixels [from, to) of one plane, which count as far as plane z lies within their spans.
template <class Rule, class Source>
HWY_INLINE void add_parts(const Rule& rule, const Source& source, std::int64_t from,
                          std::int64_t to, float z, const float* low, const float* high,
                          float* state, std::ptrdiff_t plane) {
    const DF d;
    const VF here = hn::Set(d, z), before = hn::Set(d, z - 1), after = hn::Set(d, z + 1);
    for (std::int64_t i = from; i < to; i += kLanes) {
        const VF a = hn::LoadU(d, low + i), b = hn::LoadU(d, high + i);
        // Where the neighbouring plane does not count, its share is this one's.
        const VF begin = hn::IfThenElse(hn::Lt(before, a), a, hn::Set(d, z - 0.5f));
        const VF end = hn::IfThenElse(hn::Gt(after, b), b, hn::Set(d, z + 0.5f));
        const MF none = hn::Or(hn::Or(hn::Lt(here, a), hn::Gt(here, b)), beyond(to - i));
        rule.add(source.at(i, to - i), hn::Sub(end, begin), false, none, state + i, plane);
    }
}

/// Calls body.template operator()<Rule>() with the rule of a request.
template <bool kFinite, class Body>
HWY_INLINE void with_rule(const Combining& with, const Body& body) {
    switch (with.rule) {
        case Combine::max:
            return body.template run<MaxRule<kFinite>>();
        case Combine::sum:
        case Combine::mean:
            return body.template run<LineRule<kFinite>>();
        case Combine::over:
            return with.optics->grey ? body.template run<OverRule<kFinite, 1>>()
                                     : body.template run<OverRule<kFinite, 3>>();
        case Combine::other:
        case Combine::hit:
            return body.template run<OtherRule>();
    }
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
