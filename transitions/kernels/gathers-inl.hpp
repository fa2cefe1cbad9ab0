// Samples of any vector type at computed addresses, as f32; compiled once a target (Highway's
// foreach_target). No pragma once: the guard toggles, so that every target sees the text once.
#if defined(EDGEWISE_GATHERS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_GATHERS_INL
#undef EDGEWISE_GATHERS_INL
#else
#define EDGEWISE_GATHERS_INL
#endif

#include <cstdint>
#include <type_traits>

#include "graph/samples.hpp"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::gathers {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using VF = hn::Vec<Floats>;
using VI = hn::Vec<Ints>;

// Highway's gathers leave the destination undefined, and with AVX-512 g++ then reuses the register
// of the gather before: each waits for the last, at twice the time. A zeroed destination cuts the
// chain.
#undef EDGEWISE_FRESH_GATHERS
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
#define EDGEWISE_FRESH_GATHERS 1
#else
#define EDGEWISE_FRESH_GATHERS 0
#endif

/// A 32-bit word at base + offset bytes; narrow samples that follow the first come with it.
HWY_INLINE VI gather_words(const std::uint8_t* base, VI offset) {
#if EDGEWISE_FRESH_GATHERS
    return VI{_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), 0xffff, offset.raw, base, 1)};
#else
    return hn::GatherOffset(Ints(), reinterpret_cast<const std::int32_t*>(base), offset);
#endif
}

/// The k-th sample of type T within little-endian words.
template <class T, int k>
HWY_INLINE VF sample_in(VI words) {
    constexpr int kBits = 8 * sizeof(T);
    const Ints di;
    if constexpr (std::is_signed_v<T>) {
        return hn::ConvertTo(
            Floats(), hn::ShiftRight<32 - kBits>(hn::ShiftLeft<32 - kBits - k * kBits>(words)));
    } else {
        const VI mask = hn::Set(di, (1 << kBits) - 1);
        return hn::ConvertTo(Floats(), hn::And(hn::ShiftRight<k * kBits>(words), mask));
    }
}

/// One sample at each offset.
template <class T>
HWY_INLINE VF gather_one(const std::uint8_t* base, VI offset) {
    if constexpr (std::is_same_v<T, float>) {
        return hn::BitCast(Floats(), gather_words(base, offset));
    } else {
        return sample_in<T, 0>(gather_words(base, offset));
    }
}

struct Pair {
    VF first, second;
};

/// A sample and its successor in memory: half as many gathered elements as one by one.
template <class T>
HWY_INLINE Pair gather_pair(const std::uint8_t* base, VI offset) {
    if constexpr (std::is_same_v<T, float>) {
#if HWY_TARGET == HWY_EMU128 || HWY_TARGET == HWY_SCALAR
        return {gather_one<T>(base, offset), gather_one<T>(base + sizeof(T), offset)};
#elif EDGEWISE_FRESH_GATHERS
        const Floats d;
        const __m512i zero = _mm512_setzero_si512();
        const __m256i first = _mm512_castsi512_si256(offset.raw);
        const __m256i second = _mm512_extracti64x4_epi64(offset.raw, 1);
        const VI low{_mm512_mask_i32gather_epi64(zero, 0xff, first, base, 1)};
        const VI high{_mm512_mask_i32gather_epi64(zero, 0xff, second, base, 1)};
        return {hn::ConcatEven(d, hn::BitCast(d, high), hn::BitCast(d, low)),
                hn::ConcatOdd(d, hn::BitCast(d, high), hn::BitCast(d, low))};
#else
        const Floats d;
        const hn::RepartitionToWide<Ints> wide;
        const auto* words = reinterpret_cast<const std::int64_t*>(base);
        const hn::Half<Ints> half;
        const auto low =
            hn::GatherOffset(wide, words, hn::PromoteTo(wide, hn::LowerHalf(half, offset)));
        const auto high =
            hn::GatherOffset(wide, words, hn::PromoteTo(wide, hn::UpperHalf(half, offset)));
        return {hn::ConcatEven(d, hn::BitCast(d, high), hn::BitCast(d, low)),
                hn::ConcatOdd(d, hn::BitCast(d, high), hn::BitCast(d, low))};
#endif
    } else {
        const VI words = gather_words(base, offset);
        return {sample_in<T, 0>(words), sample_in<T, 1>(words)};
    }
}

/// a + f (b - a) (EQ 14). Where f is 0 the sample itself: not 0 * NaN, and -0 keeps its sign.
/// At the far border f = 1, where this formula would be off by a rounding.
template <class T>
HWY_INLINE VF between(VF a, VF b, VF f) {
    const Floats d;
    VF blend = hn::MulAdd(f, hn::Sub(b, a), a);
    if constexpr (!std::is_same_v<T, float>) return blend;
    blend = hn::IfThenElse(hn::Eq(f, hn::Set(d, 1.0f)), b, blend);
    return hn::IfThenElse(hn::Eq(f, hn::Zero(d)), a, blend);
}

/// Calls `use(T{})` with the stored type.
template <class Use>
void with_type(Type type, const Use& use) {
    switch (type) {
        case Type::u8:
            return use(std::uint8_t{});
        case Type::i8:
            return use(std::int8_t{});
        case Type::u16:
            return use(std::uint16_t{});
        case Type::i16:
            return use(std::int16_t{});
        default:
            return use(float{});
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels::gathers
HWY_AFTER_NAMESPACE();

#endif
