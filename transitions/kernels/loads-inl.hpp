// Vectors of samples read by one load a lane, for processors with slow gathers (slow_gathers.hpp).
// Compiled once a target (Highway's foreach_target). No pragma once: the guard toggles, so that
// every target sees the text once.
#if defined(EDGEWISE_LOADS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_LOADS_INL
#undef EDGEWISE_LOADS_INL
#else
#define EDGEWISE_LOADS_INL
#endif

#include <cstdint>
#include <cstring>

#include "hwy/highway.h"

// Targets below have no gather that could be slow.
#undef EDGEWISE_LOADS
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
#define EDGEWISE_LOADS 1
#else
#define EDGEWISE_LOADS 0
#endif

#if EDGEWISE_LOADS
HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::loads {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Ints = hn::CappedTag<std::int32_t, 16>;
using VI = hn::Vec<Ints>;

inline constexpr int kQuarters = static_cast<int>(hn::MaxLanes(Ints())) / 4;  // of 128 bits

template <int k>
HWY_INLINE __m128i quarter(VI v) {
#if HWY_TARGET <= HWY_AVX3
    if constexpr (k == 0) return _mm512_castsi512_si128(v.raw);
    return _mm512_extracti32x4_epi32(v.raw, k);
#else
    if constexpr (k == 0) return _mm256_castsi256_si128(v.raw);
    return _mm256_extracti128_si256(v.raw, k);
#endif
}

HWY_INLINE VI joined(const __m128i (&part)[kQuarters]) {
#if HWY_TARGET <= HWY_AVX3
    return VI{_mm512_inserti64x4(_mm512_castsi256_si512(_mm256_set_m128i(part[1], part[0])),
                                 _mm256_set_m128i(part[3], part[2]), 1)};
#else
    return VI{_mm256_set_m128i(part[1], part[0])};
#endif
}

/// The lower half of long words, or the upper one.
template <int kHalf>
HWY_INLINE VI joined_half(const __m256i (&part)[kQuarters]) {
#if HWY_TARGET <= HWY_AVX3
    return VI{_mm512_inserti64x4(_mm512_castsi256_si512(part[2 * kHalf]), part[2 * kHalf + 1], 1)};
#else
    return VI{part[kHalf]};
#endif
}

template <class Word>
HWY_INLINE Word load(const std::uint8_t* at) {
    Word word;
    std::memcpy(&word, at, sizeof(Word));
    return word;
}

/// Four offsets, taken out of a vector by two moves: stored and read again they would wait for each
/// other.
struct FourOffsets {
    std::int64_t at[4];

    HWY_INLINE explicit FourOffsets(__m128i offsets) {
        const std::int64_t low = _mm_cvtsi128_si64(offsets), high = _mm_extract_epi64(offsets, 1);
        at[0] = static_cast<std::int32_t>(low);
        at[1] = low >> 32;
        at[2] = static_cast<std::int32_t>(high);
        at[3] = high >> 32;
    }
    HWY_INLINE __m128i words(const std::uint8_t* base) const {
        __m128i words = _mm_cvtsi32_si128(load<std::int32_t>(base + at[0]));
        words = _mm_insert_epi32(words, load<std::int32_t>(base + at[1]), 1);
        words = _mm_insert_epi32(words, load<std::int32_t>(base + at[2]), 2);
        return _mm_insert_epi32(words, load<std::int32_t>(base + at[3]), 3);
    }
    HWY_INLINE __m256i long_words(const std::uint8_t* base) const {
        __m128i low = _mm_cvtsi64_si128(load<std::int64_t>(base + at[0]));
        low = _mm_insert_epi64(low, load<std::int64_t>(base + at[1]), 1);
        __m128i high = _mm_cvtsi64_si128(load<std::int64_t>(base + at[2]));
        high = _mm_insert_epi64(high, load<std::int64_t>(base + at[3]), 1);
        return _mm256_set_m128i(high, low);
    }
};

/// Quarters k and up of all rows: an offset is used for every row while it is in a register.
template <int k, int kRows>
HWY_INLINE void words_from(const std::uint8_t* const (&rows)[kRows], VI offset,
                           __m128i (&part)[kRows][kQuarters]) {
    const FourOffsets four(quarter<k>(offset));
    for (int r = 0; r < kRows; ++r) part[r][k] = four.words(rows[r]);
    if constexpr (k + 1 < kQuarters) words_from<k + 1, kRows>(rows, offset, part);
}
template <int k, int kRows>
HWY_INLINE void long_words_from(const std::uint8_t* const (&rows)[kRows], VI offset,
                                __m256i (&part)[kRows][kQuarters]) {
    const FourOffsets four(quarter<k>(offset));
    for (int r = 0; r < kRows; ++r) part[r][k] = four.long_words(rows[r]);
    if constexpr (k + 1 < kQuarters) long_words_from<k + 1, kRows>(rows, offset, part);
}

/// Asks for the lines of every kApart-th lane in each row, from quarter k on. Places may lie
/// outside the array: they are numbers, not pointers.
template <int k, int kApart, int kRows>
HWY_INLINE void prefetch_from(const std::uintptr_t (&rows)[kRows], VI offset) {
    const FourOffsets four(quarter<k>(offset));
    for (const std::uintptr_t row : rows)
        for (int lane = 0; lane < 4; lane += kApart)
            _mm_prefetch(reinterpret_cast<const char*>(row + four.at[lane]), _MM_HINT_T0);
    if constexpr (k + 1 < kQuarters) prefetch_from<k + 1, kApart, kRows>(rows, offset);
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels::loads
HWY_AFTER_NAMESPACE();
#endif

#endif
