// Samples of any vector type at computed addresses, as f32; compiled once a target (Highway's
// foreach_target). No pragma once: the guard toggles, so that every target sees the text once.
#if defined(EDGEWISE_GATHERS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_GATHERS_INL
#undef EDGEWISE_GATHERS_INL
#else
#define EDGEWISE_GATHERS_INL
#endif

#include <algorithm>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "graph/samples.hpp"
#include "hwy/highway.h"
#include "transitions/kernels/loads-inl.hpp"
#include "transitions/kernels/slow_gathers.hpp"

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

/// How lanes read samples of one type.
template <class T, bool kByLoads>
struct Reads {
    using Sample = T;
    static constexpr int kBytes = sizeof(T);
    static constexpr bool kFloats = std::is_same_v<T, float>;
    static constexpr bool kLoads = kByLoads;
};

/// The last offset from a row at which so many bytes can be read.
HWY_INLINE std::int32_t last_offset(const std::uint8_t* row, std::uintptr_t end, int bytes = 4) {
    const auto left = static_cast<std::int64_t>(end - reinterpret_cast<std::uintptr_t>(row));
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(
        left - bytes, -(1 << 30), std::numeric_limits<std::int32_t>::max()));
}

/// A 32-bit word at row + offset bytes of each row; narrow samples that follow the first come with
/// it.
template <class Read, int kRows>
HWY_INLINE void gather_words(const std::uint8_t* const (&rows)[kRows], VI offset,
                             VI (&words)[kRows]) {
#if EDGEWISE_LOADS
    if constexpr (Read::kLoads) {
        namespace by_loads = loads::HWY_NAMESPACE;
        __m128i part[kRows][by_loads::kQuarters];
        by_loads::words_from<0, kRows>(rows, offset, part);
        for (int r = 0; r < kRows; ++r) words[r] = by_loads::joined(part[r]);
        return;
    }
#endif
    for (int r = 0; r < kRows; ++r) {
#if EDGEWISE_FRESH_GATHERS
        words[r] =
            VI{_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), 0xffff, offset.raw, rows[r], 1)};
#else
        words[r] = hn::GatherOffset(Ints(), reinterpret_cast<const std::int32_t*>(rows[r]), offset);
#endif
    }
}

/// The same of lanes at the end of samples behind which nothing may be read: words begin so much
/// earlier that they end there, and are shifted. What belongs behind the end is 0.
template <class Read, int kRows>
HWY_NOINLINE void gather_last_words(const std::uint8_t* const (&rows)[kRows], VI offset,
                                    std::uintptr_t end, VI (&words)[kRows]) {
    const Ints di;
    const hn::RebindToUnsigned<Ints> du;
    for (int r = 0; r < kRows; ++r) {
        const VI last = hn::Set(di, last_offset(rows[r], end)), at = hn::Min(offset, last);
        const VI beyond = hn::Min(hn::Sub(offset, at), hn::Set(di, 3));
        VI word[1];
        gather_words<Read, 1>({rows[r]}, at, word);
        words[r] = hn::BitCast(
            di, hn::Shr(hn::BitCast(du, word[0]), hn::BitCast(du, hn::ShiftLeft<3>(beyond))));
    }
}

/// The words that are read, within the samples. @param rows  the last one lies farthest
/// @param end  of the samples; 0: words may reach beyond it
template <class Read, int kRows>
HWY_INLINE void gather_words(const std::uint8_t* const (&rows)[kRows], VI offset,
                             std::uintptr_t end, VI (&words)[kRows]) {
    if constexpr (Read::kBytes < 4)
        if (HWY_UNLIKELY(end != 0)) {
            const Ints di;
            const VI last = hn::Set(di, last_offset(rows[kRows - 1], end));
            if (!hn::AllFalse(di, hn::Gt(offset, last)))
                return gather_last_words<Read, kRows>(rows, offset, end, words);
        }
    gather_words<Read, kRows>(rows, offset, words);
}

/// Whether lanes can ask for cache lines before they read them. Gathers keep their offsets to
/// themselves: there it would cost more than it brings.
template <class Read>
inline constexpr bool kPrefetches = EDGEWISE_LOADS&& Read::kLoads;

/// Asks for the cache lines of every kApart-th lane's sample, `ahead` bytes farther in each row.
template <class Read, int kApart, int kRows>
HWY_INLINE void prefetch([[maybe_unused]] const std::uint8_t* const (&rows)[kRows],
                         [[maybe_unused]] std::int64_t ahead, [[maybe_unused]] VI offset) {
#if EDGEWISE_LOADS
    if constexpr (kPrefetches<Read>) {
        std::uintptr_t at[kRows];
        for (int r = 0; r < kRows; ++r) at[r] = reinterpret_cast<std::uintptr_t>(rows[r]) + ahead;
        loads::HWY_NAMESPACE::prefetch_from<0, kApart, kRows>(at, offset);
    }
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

/// The sample at each offset. @param end  as of gather_words
template <class Read>
HWY_INLINE VF gather_one(const std::uint8_t* base, VI offset, std::uintptr_t end = 0) {
    VI words[1];
    gather_words<Read, 1>({base}, offset, end, words);
    if constexpr (Read::kFloats)
        return hn::BitCast(Floats(), words[0]);
    else
        return sample_in<typename Read::Sample, 0>(words[0]);
}

struct Pair {
    VF first, second;
};

#if HWY_TARGET != HWY_EMU128 && HWY_TARGET != HWY_SCALAR
/// The 64-bit words at the offsets of the lower half of the lanes, or of the upper half.
template <bool kUpper>
HWY_INLINE VI gather_long_words(const std::uint8_t* base, VI offset) {
    const hn::Half<Ints> half;
    const auto some = kUpper ? hn::UpperHalf(half, offset) : hn::LowerHalf(half, offset);
#if EDGEWISE_FRESH_GATHERS
    return VI{_mm512_mask_i32gather_epi64(_mm512_setzero_si512(), 0xff, some.raw, base, 1)};
#else
    const hn::RepartitionToWide<Ints> wide;
    const auto* words = reinterpret_cast<const std::int64_t*>(base);
    return hn::BitCast(Ints(), hn::GatherOffset(wide, words, hn::PromoteTo(wide, some)));
#endif
}

/// Every first and every second float of two halves.
HWY_INLINE Pair parted(VI low, VI high) {
    const Floats d;
    const VF l = hn::BitCast(d, low), h = hn::BitCast(d, high);
    return {hn::ConcatEven(d, h, l), hn::ConcatOdd(d, h, l)};
}
#endif

/// The same where one is the last of the samples.
template <class Read, int kRows>
HWY_NOINLINE void gather_last_pairs(const std::uint8_t* const (&rows)[kRows], VI offset,
                                    std::uintptr_t end, Pair (&pairs)[kRows]) {
    const Ints di;
    for (int r = 0; r < kRows; ++r) {
        const VI next = hn::Min(offset, hn::Set(di, last_offset(rows[r], end, 8)));
        pairs[r] = {gather_one<Read>(rows[r], offset),
                    gather_one<Read>(rows[r] + Read::kBytes, next)};
    }
}

/// A float and its successor in memory.
template <class Read, int kRows>
HWY_INLINE void gather_float_pairs(const std::uint8_t* const (&rows)[kRows], VI offset,
                                   Pair (&pairs)[kRows]) {
#if HWY_TARGET == HWY_EMU128 || HWY_TARGET == HWY_SCALAR
    for (int r = 0; r < kRows; ++r)
        pairs[r] = {gather_one<Read>(rows[r], offset),
                    gather_one<Read>(rows[r] + Read::kBytes, offset)};
#else
#if EDGEWISE_LOADS
    if constexpr (Read::kLoads) {
        namespace by_loads = loads::HWY_NAMESPACE;
        __m256i part[kRows][by_loads::kQuarters];
        by_loads::long_words_from<0, kRows>(rows, offset, part);
        for (int r = 0; r < kRows; ++r)
            pairs[r] = parted(by_loads::joined_half<0>(part[r]), by_loads::joined_half<1>(part[r]));
        return;
    }
#endif
    for (int r = 0; r < kRows; ++r)
        pairs[r] = parted(gather_long_words<false>(rows[r], offset),
                          gather_long_words<true>(rows[r], offset));
#endif
}

/// A sample and its successor in memory, in each row: half as many gathered elements as one by one.
/// Of the last sample the successor is nothing. @param rows, end  as of gather_words
template <class Read, int kRows>
HWY_INLINE void gather_pairs(const std::uint8_t* const (&rows)[kRows], VI offset,
                             std::uintptr_t end, Pair (&pairs)[kRows]) {
    if constexpr (Read::kFloats) {
        if (HWY_UNLIKELY(end != 0)) {
            const Ints di;
            const VI last = hn::Set(di, last_offset(rows[kRows - 1], end, 8));
            if (!hn::AllFalse(di, hn::Gt(offset, last)))
                return gather_last_pairs<Read, kRows>(rows, offset, end, pairs);
        }
        gather_float_pairs<Read, kRows>(rows, offset, pairs);
    } else {
        using T = typename Read::Sample;
        VI words[kRows];
        gather_words<Read, kRows>(rows, offset, end, words);
        for (int r = 0; r < kRows; ++r)
            pairs[r] = {sample_in<T, 0>(words[r]), sample_in<T, 1>(words[r])};
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

template <bool kLoads, class Use>
void with_samples(Type type, const Use& use) {
    switch (type) {
        case Type::u8:
            return use(Reads<std::uint8_t, kLoads>());
        case Type::i8:
            return use(Reads<std::int8_t, kLoads>());
        case Type::u16:
            return use(Reads<std::uint16_t, kLoads>());
        case Type::i16:
            return use(Reads<std::int16_t, kLoads>());
        default:
            return use(Reads<float, kLoads>());
    }
}

/// Calls `use(Reads<the stored type, how this processor reads it faster>())`.
template <class Use>
void with_reads(Type type, const Use& use) {
#if EDGEWISE_LOADS
    if (gathers_are_slow()) return with_samples<true>(type, use);
#endif
    with_samples<false>(type, use);
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels::gathers
HWY_AFTER_NAMESPACE();

#endif
