// Rows of weighted sums and of extremes over neighbourhoods.
#include <cstring>

#include "transitions/kernels/neighbourhood.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/neighbourhood_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// A row is worked off by so many vectors at once, which hide the latency of each other.
constexpr int kAtOnce = 4;

/// The first `count` values of a vector, or all where that is more.
template <class T, class Vector>
HWY_INLINE void store(Vector values, std::int64_t count, T* out) {
    const hn::ScalableTag<T> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    if (count >= lanes) {
        hn::StoreU(values, d, out);
        return;
    }
    HWY_ALIGN T part[HWY_MAX_BYTES / sizeof(T)];
    hn::Store(values, d, part);
    std::memcpy(out, part, static_cast<std::size_t>(count) * sizeof(T));
}

/// All of a block is read before any of it is written, and blocks go upward: `out` may be `in`
/// where places are at least 0.
/// @param start     of a vector, from its place in the row
/// @param together  (result so far, a vector of samples, t) -> the new result
template <class T, class Start, class Together>
HWY_INLINE void each_block(const T* in, const std::ptrdiff_t* HWY_RESTRICT places,
                           std::size_t count, std::int64_t n, T* out, const Start& start,
                           const Together& together) {
    const hn::ScalableTag<T> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    std::int64_t i = 0;
    for (; i + kAtOnce * lanes <= n; i += kAtOnce * lanes) {
        auto a = start(i), b = start(i + lanes), c = start(i + 2 * lanes), e = start(i + 3 * lanes);
        for (std::size_t t = 0; t < count; ++t) {
            const T* from = in + i + places[t];
            a = together(a, hn::LoadU(d, from), t);
            b = together(b, hn::LoadU(d, from + lanes), t);
            c = together(c, hn::LoadU(d, from + 2 * lanes), t);
            e = together(e, hn::LoadU(d, from + 3 * lanes), t);
        }
        hn::StoreU(a, d, out + i);
        hn::StoreU(b, d, out + i + lanes);
        hn::StoreU(c, d, out + i + 2 * lanes);
        hn::StoreU(e, d, out + i + 3 * lanes);
    }
    for (; i < n; i += lanes) {
        auto a = start(i);
        for (std::size_t t = 0; t < count; ++t)
            a = together(a, hn::LoadU(d, in + i + places[t]), t);
        store(a, n - i, out + i);
    }
}

template <class T>
HWY_INLINE void sum(const T* in, const std::ptrdiff_t* places, const T* weights, std::size_t count,
                    bool adds, T* out, std::int64_t n) {
    const hn::ScalableTag<T> d;
    each_block(
        in, places, count, n, out,
        [&](std::int64_t i) { return adds ? hn::LoadU(d, out + i) : hn::Zero(d); },
        [&](auto so_far, auto samples, std::size_t t) {
            return hn::MulAdd(hn::Set(d, weights[t]), samples, so_far);
        });
}

/// The same of so few places that they stay in registers.
template <int kCount, class T, class Together>
HWY_INLINE void each_block_of(const T* in, const std::ptrdiff_t* HWY_RESTRICT places,
                              std::int64_t n, T* out, const Together& together) {
    const hn::ScalableTag<T> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    const T* from[kCount];
    for (int t = 0; t < kCount; ++t) from[t] = in + places[t];
    const auto at = [&](std::int64_t i) {
        auto so_far = hn::LoadU(d, from[0] + i);
        for (int t = 1; t < kCount; ++t) so_far = together(so_far, hn::LoadU(d, from[t] + i));
        return so_far;
    };
    std::int64_t i = 0;
    for (; i + kAtOnce * lanes <= n; i += kAtOnce * lanes) {
        const auto a = at(i), b = at(i + lanes), c = at(i + 2 * lanes), e = at(i + 3 * lanes);
        hn::StoreU(a, d, out + i);
        hn::StoreU(b, d, out + i + lanes);
        hn::StoreU(c, d, out + i + 2 * lanes);
        hn::StoreU(e, d, out + i + 3 * lanes);
    }
    for (; i < n; i += lanes) store(at(i), n - i, out + i);
}

template <class T, class Together>
HWY_INLINE void extreme_by(const T* in, const std::ptrdiff_t* places, std::size_t count, T* out,
                           std::int64_t n, const Together& together) {
    if (count == 2) return each_block_of<2>(in, places, n, out, together);
    if (count == 3) return each_block_of<3>(in, places, n, out, together);
    if (count == 4) return each_block_of<4>(in, places, n, out, together);
    const hn::ScalableTag<T> d;
    each_block(
        in, places + 1, count - 1, n, out,
        [&](std::int64_t i) { return hn::LoadU(d, in + i + places[0]); },
        [&](auto a, auto b, std::size_t) { return together(a, b); });
}

template <class T>
HWY_INLINE void extreme(const T* in, const std::ptrdiff_t* places, std::size_t count, bool least,
                        T* out, std::int64_t n) {
    if (least)
        extreme_by(in, places, count, out, n, [](auto a, auto b) { return hn::Min(a, b); });
    else
        extreme_by(in, places, count, out, n, [](auto a, auto b) { return hn::Max(a, b); });
}

template <class T>
HWY_INLINE void grey(const T* in, const std::ptrdiff_t* places, const T* weights, std::size_t count,
                     bool least, T* out, std::int64_t n) {
    const hn::ScalableTag<T> d;
    const T sign = least ? T(-1) : T(1);
    const auto moved = [&](auto samples, std::size_t t) {
        return hn::Add(samples, hn::Set(d, sign * weights[t]));
    };
    each_block(
        in, places + 1, count - 1, n, out,
        [&](std::int64_t i) { return moved(hn::LoadU(d, in + i + places[0]), 0); },
        [&](auto so_far, auto samples, std::size_t t) {
            const auto other = moved(samples, t + 1);
            const auto both = least ? hn::Min(so_far, other) : hn::Max(so_far, other);
            // A sum with NaN is NaN, whichever of both it is.
            const auto unknown = hn::Or(hn::IsNaN(so_far), hn::IsNaN(other));
            return hn::IfThenElse(unknown, hn::Add(so_far, other), both);
        });
}

/// Adds a row of samples to the sums of rows kFirst ... kLast of kRows, each by its own weights.
/// @param weights  of row 0; those of the next row lie x before them
template <int kFirst, int kLast, class T, class Vector, int kRows, int kVectors>
HWY_INLINE void add_samples(const T* HWY_RESTRICT in, const T* HWY_RESTRICT weights, std::int64_t x,
                            Vector (&sums)[kRows][kVectors]) {
    const hn::ScalableTag<T> d;
    const auto lanes = static_cast<std::ptrdiff_t>(hn::Lanes(d));
    for (std::int64_t a = 0; a < x; ++a) {
        Vector samples[kVectors];
        for (int v = 0; v < kVectors; ++v) samples[v] = hn::LoadU(d, in + a + v * lanes);
        for (int r = kFirst; r <= kLast; ++r) {
            const auto weight = hn::Set(d, weights[a - r * x]);
            for (int v = 0; v < kVectors; ++v)
                sums[r][v] = hn::MulAdd(weight, samples[v], sums[r][v]);
        }
    }
}

/// kRows rows of kVectors vectors, of which `count` values are written. Needs box.y + 1 >= kRows.
template <int kRows, int kVectors, class T>
HWY_INLINE void sum_block(const T* in, std::ptrdiff_t in_row, std::ptrdiff_t in_slice,
                          const WeightBox<T>& box, T* out, std::ptrdiff_t out_row,
                          std::int64_t count) {
    const hn::ScalableTag<T> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    hn::Vec<decltype(d)> sums[kRows][kVectors];
    for (int r = 0; r < kRows; ++r)
        for (int v = 0; v < kVectors; ++v) sums[r][v] = hn::Zero(d);
    for (std::int64_t c = 0; c < box.z; ++c) {
        const T* row = in + c * in_slice;
        const T* weights = box.weights + c * box.y * box.x;
        // Row b of the samples is in the sums of rows b, b - 1 ... as far as the box reaches.
        const auto next = [&] { row += in_row, weights += box.x; };
        if constexpr (kRows > 1) {
            add_samples<0, 0>(row, weights, box.x, sums);
            next();
        }
        if constexpr (kRows > 2) {
            add_samples<0, 1>(row, weights, box.x, sums);
            next();
            add_samples<0, 2>(row, weights, box.x, sums);
            next();
        }
        for (std::int64_t b = kRows - 1; b < box.y; ++b, next())
            add_samples<0, kRows - 1>(row, weights, box.x, sums);
        if constexpr (kRows > 2) {
            add_samples<1, 3>(row, weights, box.x, sums);
            next();
            add_samples<2, 3>(row, weights, box.x, sums);
            next();
        }
        if constexpr (kRows > 1) add_samples<kRows - 1, kRows - 1>(row, weights, box.x, sums);
    }
    for (int r = 0; r < kRows; ++r)
        for (int v = 0; v < kVectors; ++v)
            store(sums[r][v], count - v * lanes, out + r * out_row + v * lanes);
}

template <int kRows, class T>
HWY_INLINE void sum_some_rows(const T* in, std::ptrdiff_t in_row, std::ptrdiff_t in_slice,
                              const WeightBox<T>& box, T* out, std::ptrdiff_t out_row,
                              std::int64_t n) {
    // With those of samples and one weight as many vectors as AVX2 has registers.
    constexpr int kVectors = 3;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(hn::ScalableTag<T>()));
    std::int64_t i = 0;
    for (; i + kVectors * lanes <= n; i += kVectors * lanes)
        sum_block<kRows, kVectors>(in + i, in_row, in_slice, box, out + i, out_row,
                                   kVectors * lanes);
    for (; i < n; i += lanes)
        sum_block<kRows, 1>(in + i, in_row, in_slice, box, out + i, out_row, n - i);
}

template <class T>
HWY_INLINE void sums(const T* in, std::ptrdiff_t in_row, std::ptrdiff_t in_slice,
                     const WeightBox<T>& box, T* out, std::ptrdiff_t out_row, std::int64_t n,
                     std::int64_t rows) {
    std::int64_t r = 0;
    for (; box.y > 2 && r + 4 <= rows; r += 4)
        sum_some_rows<4>(in + r * in_row, in_row, in_slice, box, out + r * out_row, out_row, n);
    for (; r + 2 <= rows; r += 2)
        sum_some_rows<2>(in + r * in_row, in_row, in_slice, box, out + r * out_row, out_row, n);
    if (r < rows)
        sum_some_rows<1>(in + r * in_row, in_row, in_slice, box, out + r * out_row, out_row, n);
}

#define EDGEWISE_NEIGHBOURHOOD_SUMS(T, NAME)                                                       \
    void Sum##NAME(const T* in, const std::ptrdiff_t* places, const T* weights, std::size_t count, \
                   bool adds, T* out, std::int64_t n) {                                            \
        sum(in, places, weights, count, adds, out, n);                                             \
    }                                                                                              \
    void SumRows##NAME(const T* in, std::ptrdiff_t in_row, std::ptrdiff_t in_slice,                \
                       const WeightBox<T>& box, T* out, std::ptrdiff_t out_row, std::int64_t n,    \
                       std::int64_t rows) {                                                        \
        sums(in, in_row, in_slice, box, out, out_row, n, rows);                                    \
    }                                                                                              \
    void Grey##NAME(const T* in, const std::ptrdiff_t* places, const T* weights,                   \
                    std::size_t count, bool least, T* out, std::int64_t n) {                       \
        grey(in, places, weights, count, least, out, n);                                           \
    }
#define EDGEWISE_NEIGHBOURHOOD_EXTREMES(T, NAME)                                                 \
    void Extreme##NAME(const T* in, const std::ptrdiff_t* places, std::size_t count, bool least, \
                       T* out, std::int64_t n) {                                                 \
        extreme(in, places, count, least, out, n);                                               \
    }
EDGEWISE_NEIGHBOURHOOD_SUMS(float, F32)
EDGEWISE_NEIGHBOURHOOD_SUMS(double, F64)
EDGEWISE_NEIGHBOURHOOD_EXTREMES(std::uint8_t, U8)
EDGEWISE_NEIGHBOURHOOD_EXTREMES(std::int8_t, I8)
EDGEWISE_NEIGHBOURHOOD_EXTREMES(std::uint16_t, U16)
EDGEWISE_NEIGHBOURHOOD_EXTREMES(std::int16_t, I16)
EDGEWISE_NEIGHBOURHOOD_EXTREMES(std::uint32_t, U32)
EDGEWISE_NEIGHBOURHOOD_EXTREMES(std::int32_t, I32)
EDGEWISE_NEIGHBOURHOOD_EXTREMES(float, F32)
EDGEWISE_NEIGHBOURHOOD_EXTREMES(double, F64)
#undef EDGEWISE_NEIGHBOURHOOD_SUMS
#undef EDGEWISE_NEIGHBOURHOOD_EXTREMES

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(SumF32);
HWY_EXPORT(SumF64);
HWY_EXPORT(SumRowsF32);
HWY_EXPORT(SumRowsF64);
HWY_EXPORT(GreyF32);
HWY_EXPORT(GreyF64);
HWY_EXPORT(ExtremeU8);
HWY_EXPORT(ExtremeI8);
HWY_EXPORT(ExtremeU16);
HWY_EXPORT(ExtremeI16);
HWY_EXPORT(ExtremeU32);
HWY_EXPORT(ExtremeI32);
HWY_EXPORT(ExtremeF32);
HWY_EXPORT(ExtremeF64);

void sum_row(const float* in, const std::ptrdiff_t* places, const float* weights, std::size_t count,
             bool adds, float* out, std::int64_t n) {
    HWY_DYNAMIC_DISPATCH(SumF32)(in, places, weights, count, adds, out, n);
}
void sum_row(const double* in, const std::ptrdiff_t* places, const double* weights,
             std::size_t count, bool adds, double* out, std::int64_t n) {
    HWY_DYNAMIC_DISPATCH(SumF64)(in, places, weights, count, adds, out, n);
}
void sum_rows(const float* in, std::ptrdiff_t in_row, std::ptrdiff_t in_slice,
              const WeightBox<float>& box, float* out, std::ptrdiff_t out_row, std::int64_t n,
              std::int64_t rows) {
    HWY_DYNAMIC_DISPATCH(SumRowsF32)(in, in_row, in_slice, box, out, out_row, n, rows);
}
void sum_rows(const double* in, std::ptrdiff_t in_row, std::ptrdiff_t in_slice,
              const WeightBox<double>& box, double* out, std::ptrdiff_t out_row, std::int64_t n,
              std::int64_t rows) {
    HWY_DYNAMIC_DISPATCH(SumRowsF64)(in, in_row, in_slice, box, out, out_row, n, rows);
}
void grey_row(const float* in, const std::ptrdiff_t* places, const float* weights,
              std::size_t count, bool least, float* out, std::int64_t n) {
    HWY_DYNAMIC_DISPATCH(GreyF32)(in, places, weights, count, least, out, n);
}
void grey_row(const double* in, const std::ptrdiff_t* places, const double* weights,
              std::size_t count, bool least, double* out, std::int64_t n) {
    HWY_DYNAMIC_DISPATCH(GreyF64)(in, places, weights, count, least, out, n);
}

#define EDGEWISE_EXTREME_ROW(T, NAME)                                                          \
    template <>                                                                                \
    void extreme_row(const T* in, const std::ptrdiff_t* places, std::size_t count, bool least, \
                     T* out, std::int64_t n) {                                                 \
        HWY_DYNAMIC_DISPATCH(Extreme##NAME)(in, places, count, least, out, n);                 \
    }
EDGEWISE_EXTREME_ROW(std::uint8_t, U8)
EDGEWISE_EXTREME_ROW(std::int8_t, I8)
EDGEWISE_EXTREME_ROW(std::uint16_t, U16)
EDGEWISE_EXTREME_ROW(std::int16_t, I16)
EDGEWISE_EXTREME_ROW(std::uint32_t, U32)
EDGEWISE_EXTREME_ROW(std::int32_t, I32)
EDGEWISE_EXTREME_ROW(float, F32)
EDGEWISE_EXTREME_ROW(double, F64)
#undef EDGEWISE_EXTREME_ROW

}  // namespace edgewise::kernels
#endif
