// Cells of which something may be seen: ranges of four samples against the values that add nothing.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "transitions/kernels/visible_runs.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/visible_cells_simd.cpp"
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

/// Interpolation rounds: values may lie beyond both samples by this much of their difference (three
/// roundings of 2^-24, one after the other).
constexpr float kBeyond = 0x1p-22f;

/// One span in samples. Cells whose samples are all equal have no rounding.
template <class T>
struct Ends {
    T low, high;            // of cells that are not constant
    T flat_low, flat_high;  // of constant cells
};

template <class T>
Ends<T> ends_of(const UnseenSpan& span) {
    if constexpr (std::is_floating_point_v<T>) {
        return {span.low, span.high, span.low, span.high};  // widened cell by cell
    } else {
        constexpr double kWidest = 65535 * static_cast<double>(kBeyond);
        const double first = static_cast<double>(kLeast<T>),
                     last = static_cast<double>(kGreatest<T>);
        const auto range = [&](double low, double high, T& from, T& to) {
            low = std::ceil(low), high = std::floor(high);
            const bool none = !(low <= high) || low > last || high < first;
            // No sample is the greatest and the least.
            from = none ? kGreatest<T> : static_cast<T>(std::clamp(low, first, last));
            to = none ? kLeast<T> : static_cast<T>(std::clamp(high, first, last));
        };
        const double low = static_cast<double>(span.low), high = static_cast<double>(span.high);
        Ends<T> ends;
        range(low + kWidest, high - kWidest, ends.low, ends.high);
        range(low, high, ends.flat_low, ends.flat_high);
        return ends;
    }
}

/// What stands for samples that are not finite.
template <class D, class V>
HWY_INLINE V finite_or(D d, V v, hn::TFromD<D> instead) {
    if constexpr (!std::is_floating_point_v<hn::TFromD<D>>) return v;
    // Comparisons with NaN are false.
    else
        return hn::IfThenElse(hn::Le(hn::Abs(v), hn::Set(d, kGreatest<hn::TFromD<D>>)), v,
                              hn::Set(d, instead));
}

/// Whether low >= least and high <= most.
template <class V>
HWY_INLINE auto within(V low, V high, V least, V most) {
    return hn::And(hn::Eq(hn::Max(low, least), low), hn::Eq(hn::Min(high, most), high));
}

template <class T>
void cells_of(const T* upper, const T* lower, std::int64_t n, std::span<const UnseenSpan> unseen,
              T* scratch, std::uint64_t* bits) {
    const hn::ScalableTag<T> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    std::array<Ends<T>, kMostUnseen> ends;
    for (std::size_t i = 0; i < unseen.size(); ++i) ends[i] = ends_of<T>(unseen[i]);

    T* low = scratch;
    T* high = scratch + n + 4 * kSlack / sizeof(float);
    for (std::int64_t x = 0; x < n; x += lanes) {
        const auto a = hn::LoadU(d, upper + x), b = hn::LoadU(d, lower + x);
        hn::StoreU(hn::Min(finite_or(d, a, kGreatest<T>), finite_or(d, b, kGreatest<T>)), d,
                   low + x);
        hn::StoreU(hn::Max(finite_or(d, a, kLeast<T>), finite_or(d, b, kLeast<T>)), d, high + x);
    }
    low[n] = low[n - 1], high[n] = high[n - 1];

    std::fill_n(bits, (n + 63) / 64, 0);
    for (std::int64_t x = 0; x < n; x += lanes) {
        auto least = hn::Min(hn::LoadU(d, low + x), hn::LoadU(d, low + x + 1));
        auto most = hn::Max(hn::LoadU(d, high + x), hn::LoadU(d, high + x + 1));
        auto empty = hn::FirstN(d, 0);
        if constexpr (std::is_floating_point_v<T>) {
            const auto beyond = hn::Mul(hn::Sub(most, least), hn::Set(d, kBeyond));
            least = hn::Sub(least, beyond), most = hn::Add(most, beyond);
            for (std::size_t i = 0; i < unseen.size(); ++i)
                empty = hn::Or(
                    empty, within(least, most, hn::Set(d, ends[i].low), hn::Set(d, ends[i].high)));
        } else {
            const auto flat = hn::Eq(least, most);
            for (std::size_t i = 0; i < unseen.size(); ++i) {
                const Ends<T>& e = ends[i];
                const auto any = within(least, most, hn::Set(d, e.low), hn::Set(d, e.high));
                const auto alike =
                    within(least, most, hn::Set(d, e.flat_low), hn::Set(d, e.flat_high));
                empty = hn::Or(empty, hn::Or(any, hn::And(flat, alike)));
            }
        }
        std::uint8_t bytes[8] = {};
        hn::StoreMaskBits(d, empty, bytes);
        std::uint64_t word;
        std::memcpy(&word, bytes, sizeof word);
        const std::uint64_t all = lanes == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << lanes) - 1;
        bits[x / 64] |= (~word & all) << (x % 64);
    }
    if (n % 64 != 0) bits[n / 64] &= (std::uint64_t{1} << (n % 64)) - 1;
}

void visible_cells_on(Type type, const void* upper, const void* lower, std::int64_t n,
                      std::span<const UnseenSpan> unseen, void* scratch, std::uint64_t* bits) {
    const auto call = [&]<class T>(T) {
        cells_of(static_cast<const T*>(upper), static_cast<const T*>(lower), n, unseen,
                 static_cast<T*>(scratch), bits);
    };
    switch (type) {
        case Type::u8:
            return call(std::uint8_t{});
        case Type::i8:
            return call(std::int8_t{});
        case Type::u16:
            return call(std::uint16_t{});
        case Type::i16:
            return call(std::int16_t{});
        default:
            return call(float{});
    }
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(visible_cells_on);

void visible_cells(Type type, const void* upper, const void* lower, std::int64_t n,
                   std::span<const UnseenSpan> unseen, void* scratch, std::uint64_t* bits) {
    HWY_DYNAMIC_DISPATCH(visible_cells_on)(type, upper, lower, n, unseen, scratch, bits);
}

}  // namespace edgewise::kernels
#endif
