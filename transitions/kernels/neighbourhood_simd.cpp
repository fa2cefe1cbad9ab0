// Rows of weighted sums and of extremes over neighbourhoods.
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

/// All of a block is read before any of it is written, and blocks go upward: `out` may be `in`
/// where places are at least 0.
/// @param start     of a vector, from its place in the row
/// @param together  what has come so far, a vector of samples, and t -> what comes of both
template <class T, class Start, class Together>
HWY_INLINE void each_block(const T* in, const std::ptrdiff_t* HWY_RESTRICT places,
                           std::size_t count, std::int64_t n, T* out, const Start& start,
                           const Together& together) {
    const hn::ScalableTag<T> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    for (std::int64_t i = 0; i < n; i += kAtOnce * lanes) {
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

template <class T>
HWY_INLINE void extreme(const T* in, const std::ptrdiff_t* places, std::size_t count, bool least,
                        T* out, std::int64_t n) {
    const hn::ScalableTag<T> d;
    const auto start = [&](std::int64_t i) { return hn::LoadU(d, in + i + places[0]); };
    if (least)
        each_block(in, places + 1, count - 1, n, out, start,
                   [](auto a, auto b, std::size_t) { return hn::Min(a, b); });
    else
        each_block(in, places + 1, count - 1, n, out, start,
                   [](auto a, auto b, std::size_t) { return hn::Max(a, b); });
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

#define EDGEWISE_NEIGHBOURHOOD_SUMS(T, NAME)                                                       \
    void Sum##NAME(const T* in, const std::ptrdiff_t* places, const T* weights, std::size_t count, \
                   bool adds, T* out, std::int64_t n) {                                            \
        sum(in, places, weights, count, adds, out, n);                                             \
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
