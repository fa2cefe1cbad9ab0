// Ranges of bricks: first over rows, a vector of samples at a time, then over four neighbours.
#include <algorithm>
#include <limits>
#include <type_traits>

#include "transitions/kernels/brick_rows.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/brick_rows_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {
namespace hn = hwy::HWY_NAMESPACE;

template <class T>
constexpr T kLeast = std::numeric_limits<T>::lowest();
template <class T>
constexpr T kGreatest = std::numeric_limits<T>::max();

/// What stands for samples that are not finite.
template <class D, class V>
HWY_INLINE V finite_or(D d, V v, hn::TFromD<D> instead) {
    if constexpr (!std::is_floating_point_v<hn::TFromD<D>>) return v;
    // Comparisons with NaN are false.
    else
        return hn::IfThenElse(hn::Le(hn::Abs(v), hn::Set(d, kGreatest<hn::TFromD<D>>)), v,
                              hn::Set(d, instead));
}

#if HWY_TARGET == HWY_SCALAR
template <class T>
void ranges_of(const void* const* rows, int count, std::int64_t n, BrickRanges ranges) {
    const hn::CappedTag<T, 1> d;
    for (std::int64_t brick = 0; brick * kBrickSide < n; ++brick) {
        auto low = hn::Set(d, kGreatest<T>), high = hn::Set(d, kLeast<T>);
        for (int r = 0; r < count; ++r)
            for (std::int64_t x = brick * kBrickSide; x < std::min(n, (brick + 1) * kBrickSide);
                 ++x) {
                const auto v = hn::LoadU(d, static_cast<const T*>(rows[r]) + x);
                low = hn::Min(low, finite_or(d, v, kGreatest<T>));
                high = hn::Max(high, finite_or(d, v, kLeast<T>));
            }
        ranges.low[brick] = static_cast<float>(hn::GetLane(low));
        ranges.high[brick] = static_cast<float>(hn::GetLane(high));
    }
}
#else
/// Each lane's neighbour so many bytes above, within 16 bytes.
template <int kBytes, class D, class V>
HWY_INLINE V above(D d, V v) {
    const hn::Repartition<std::uint8_t, D> bytes;
    return hn::BitCast(d, hn::ShiftRightBytes<kBytes>(bytes, hn::BitCast(bytes, v)));
}

/// Every fourth lane as f32.
template <class D, class V>
HWY_INLINE void store_fourths(D d, V v, float* to) {
    using T = hn::TFromD<D>;
    if constexpr (sizeof(T) == 1) {
        const hn::Repartition<std::int32_t, D> words;
        auto word = hn::BitCast(words, v);
        if constexpr (std::is_signed_v<T>)
            word = hn::ShiftRight<24>(hn::ShiftLeft<24>(word));
        else
            word = hn::And(word, hn::Set(words, 0xff));
        const hn::Rebind<float, decltype(words)> floats;
        hn::StoreU(hn::ConvertTo(floats, word), floats, to);
    } else {
        HWY_ALIGN T lane[hn::MaxLanes(d)];
        hn::Store(v, d, lane);
        for (std::size_t i = 0; i < hn::Lanes(d); i += kBrickSide)
            to[i / kBrickSide] = static_cast<float>(lane[i]);
    }
}

template <class T>
void ranges_of(const void* const* rows, int count, std::int64_t n, BrickRanges ranges) {
    const hn::ScalableTag<T> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    for (std::int64_t x = 0; x < n; x += lanes) {
        auto low = hn::Set(d, kGreatest<T>), high = hn::Set(d, kLeast<T>);
        for (int r = 0; r < count; ++r) {
            const auto v = hn::LoadU(d, static_cast<const T*>(rows[r]) + x);
            low = hn::Min(low, finite_or(d, v, kGreatest<T>));
            high = hn::Max(high, finite_or(d, v, kLeast<T>));
        }
        if (n - x < lanes) {
            const auto mine = hn::FirstN(d, static_cast<std::size_t>(n - x));
            low = hn::IfThenElse(mine, low, hn::Set(d, kGreatest<T>));
            high = hn::IfThenElse(mine, high, hn::Set(d, kLeast<T>));
        }
        // Every fourth lane meets the three above it; what others meet does not matter.
        constexpr int kOne = sizeof(T), kTwo = 2 * sizeof(T);
        low = hn::Min(low, above<kOne>(d, low));
        low = hn::Min(low, above<kTwo>(d, low));
        high = hn::Max(high, above<kOne>(d, high));
        high = hn::Max(high, above<kTwo>(d, high));
        store_fourths(d, low, ranges.low + x / kBrickSide);
        store_fourths(d, high, ranges.high + x / kBrickSide);
    }
}
#endif

void brick_rows_on(Type type, const void* const* rows, int count, std::int64_t n,
                   BrickRanges ranges) {
    switch (type) {
        case Type::u8:
            return ranges_of<std::uint8_t>(rows, count, n, ranges);
        case Type::i8:
            return ranges_of<std::int8_t>(rows, count, n, ranges);
        case Type::u16:
            return ranges_of<std::uint16_t>(rows, count, n, ranges);
        case Type::i16:
            return ranges_of<std::int16_t>(rows, count, n, ranges);
        default:
            return ranges_of<float>(rows, count, n, ranges);
    }
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(brick_rows_on);

void brick_rows(Type type, const void* const* rows, int count, std::int64_t n, BrickRanges ranges) {
    HWY_DYNAMIC_DISPATCH(brick_rows_on)(type, rows, count, n, ranges);
}

}  // namespace edgewise::kernels
#endif
