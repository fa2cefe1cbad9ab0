// Samples against a bound: one bit each.
#include <cmath>
#include <cstring>
#include <type_traits>

#include "surface/inside_bits.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "surface/inside_bits_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace edgewise::surface::HWY_NAMESPACE {
namespace {
namespace hn = hwy::HWY_NAMESPACE;

/// Highway compares integers for less and greater alone.
template <bool kFalls, class V>
HWY_INLINE auto is_inside(V v, V limit) {
    if constexpr (std::is_floating_point_v<hn::TFromV<V>>) {
        if constexpr (kFalls)
            return hn::Le(v, limit);
        else
            return hn::Ge(v, limit);
    } else {
        if constexpr (kFalls)
            return hn::Eq(hn::Min(v, limit), v);
        else
            return hn::Eq(hn::Max(v, limit), v);
    }
}

/// @tparam kFalls  inside: at most the bound; else at least
template <bool kFalls, class T>
void compare(const T* row, std::int64_t n, T bound, std::uint64_t* bits) {
    const hn::ScalableTag<T> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    auto* bytes = reinterpret_cast<std::uint8_t*>(bits);
    std::int64_t x = 0;
    if (lanes >= 8) {
        const auto limit = hn::Set(d, bound);
        for (; x + lanes <= n; x += lanes) {
            const auto v = hn::LoadU(d, row + x);
            hn::StoreMaskBits(d, is_inside<kFalls>(v, limit), bytes + x / 8);
        }
    }
    for (; x < n; ++x)
        if (kFalls ? row[x] <= bound : row[x] >= bound) bits[x / 64] |= std::uint64_t{1} << x % 64;
}

template <class T>
void compare_typed(const void* row, std::int64_t n, const Level& level, std::uint64_t* bits) {
    const auto* numbers = static_cast<const T*>(row);
    const T bound = static_cast<T>(level.bound);
    if (level.falls)
        compare<true>(numbers, n, bound, bits);
    else
        compare<false>(numbers, n, bound, bits);
}

void inside_bits_of(const void* row, Type type, std::int64_t n, const Level& level,
                    std::uint64_t* bits) {
    switch (type) {
        case Type::u8:
            return compare_typed<std::uint8_t>(row, n, level, bits);
        case Type::i8:
            return compare_typed<std::int8_t>(row, n, level, bits);
        case Type::u16:
            return compare_typed<std::uint16_t>(row, n, level, bits);
        case Type::i16:
            return compare_typed<std::int16_t>(row, n, level, bits);
        default:
            return compare_typed<float>(row, n, level, bits);
    }
}

bool all_finite_in(const float* row, std::int64_t n) {
    const hn::ScalableTag<float> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    // The product with 0 is 0 for finite numbers, and NaN for others.
    auto sum = hn::Zero(d);
    std::int64_t x = 0;
    for (; x + lanes <= n; x += lanes)
        sum = hn::Add(sum, hn::Mul(hn::LoadU(d, row + x), hn::Zero(d)));
    bool finite = std::isfinite(hn::GetLane(hn::SumOfLanes(d, sum)));
    for (; x < n; ++x) finite = finite && std::isfinite(row[x]);
    return finite;
}

}  // namespace
}  // namespace edgewise::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::surface {

HWY_EXPORT(inside_bits_of);
HWY_EXPORT(all_finite_in);

void inside_bits(const void* row, Type type, std::int64_t n, const Level& level,
                 std::uint64_t* bits) noexcept {
    std::memset(bits, 0, static_cast<std::size_t>(words_of_row(n)) * sizeof(std::uint64_t));
    if (!level.none) HWY_DYNAMIC_DISPATCH(inside_bits_of)(row, type, n, level, bits);
}

bool all_finite(const float* row, std::int64_t n) noexcept {
    return HWY_DYNAMIC_DISPATCH(all_finite_in)(row, n);
}

}  // namespace edgewise::surface
#endif
