#include <algorithm>
#include <cmath>
#include <hwy/cache_control.h>
#include <limits>
#include <type_traits>

#include "reference/stored.hpp"
#include "scene/tally.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scene/tally_simd.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway demands.
#include <hwy/highway.h>

#include "reference/stored_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using namespace stored_lanes::HWY_NAMESPACE;  // NOLINT: how values are loaded

/// The sum of all lanes as 64 bits.
template <class D>
HWY_INLINE std::int64_t sum_of(D d, hn::Vec<D> v) {
    HWY_ALIGN hn::TFromD<D> lanes[HWY_MAX_BYTES / sizeof(hn::TFromD<D>)];
    hn::Store(v, d, lanes);
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) sum += static_cast<std::int64_t>(lanes[i]);
    return sum;
}
template <class D>
HWY_INLINE hn::TFromD<D> least_of(D d, hn::Vec<D> v) {
    HWY_ALIGN hn::TFromD<D> lanes[HWY_MAX_BYTES / sizeof(hn::TFromD<D>)];
    hn::Store(v, d, lanes);
    return *std::min_element(lanes, lanes + hn::Lanes(d));
}
template <class D>
HWY_INLINE hn::TFromD<D> greatest_of(D d, hn::Vec<D> v) {
    HWY_ALIGN hn::TFromD<D> lanes[HWY_MAX_BYTES / sizeof(hn::TFromD<D>)];
    hn::Store(v, d, lanes);
    return *std::max_element(lanes, lanes + hn::Lanes(d));
}

// What processors fetch ahead themselves ends with the page.
constexpr std::size_t kAhead = 4096;  // [byte]

/// What vectors have found, to which single values are added.
struct Counted {
    int low = std::numeric_limits<int>::max(), high = std::numeric_limits<int>::min();
    std::int64_t sum = 0, equal = 0;
};

#if HWY_TARGET == HWY_SCALAR

// No vectors: the callers' loops add all.
template <class L>
std::int64_t count_vectors(const L*, std::int64_t, L, L, Counted&) {
    return 0;
}
template <class L>
std::int64_t below_vectors(const L*, std::int64_t, L, L, std::int64_t&) {
    return 0;
}

#else

/// Eight bits, as unsigned numbers: signed ones with their upper bit turned.
std::int64_t count_vectors(const std::uint8_t* from, std::int64_t n, std::uint8_t flip,
                           std::uint8_t common, Counted& found) {
    const hn::ScalableTag<std::uint8_t> d;
    const hn::Repartition<std::uint64_t, decltype(d)> wide;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    const auto turned = hn::Set(d, flip), wanted = hn::Set(d, common);
    auto low = hn::Set(d, 255), high = hn::Zero(d);
    auto sum = hn::Zero(wide), equal = hn::Zero(wide);
    std::int64_t i = 0;
    while (i + lanes <= n) {
        const std::int64_t stop = std::min(n, i + 255 * lanes);  // what eight bits count to
        auto count = hn::Zero(d);
        for (; i + lanes <= stop; i += lanes) {
            hwy::Prefetch(from + i + kAhead / sizeof(*from));
            const auto v = hn::Xor(hn::LoadU(d, from + i), turned);
            low = hn::Min(low, v);
            high = hn::Max(high, v);
            count = hn::Sub(count, hn::VecFromMask(d, hn::Eq(v, wanted)));
            sum = hn::Add(sum, hn::SumsOf8(v));
        }
        equal = hn::Add(equal, hn::SumsOf8(count));
    }
    if (i > 0) {
        found.low = least_of(d, low);
        found.high = greatest_of(d, high);
    }
    found.sum = sum_of(wide, sum);
    found.equal = sum_of(wide, equal);
    return i;
}

/// Sixteen bits, as signed numbers: unsigned ones with their upper bit turned.
std::int64_t count_vectors(const std::int16_t* from, std::int64_t n, std::int16_t flip,
                           std::int16_t common, Counted& found) {
    const hn::ScalableTag<std::int16_t> d;
    const hn::Repartition<std::int32_t, decltype(d)> wide;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    const auto turned = hn::Set(d, flip), wanted = hn::Set(d, common), one = hn::Set(d, 1);
    auto low = hn::Set(d, std::numeric_limits<std::int16_t>::max());
    auto high = hn::Set(d, std::numeric_limits<std::int16_t>::min());
    std::int64_t i = 0;
    while (i + lanes <= n) {
        const std::int64_t stop = std::min(n, i + 16384 * lanes);  // 2^14 * 2 * 2^15 fit 31 bits
        auto sum = hn::Zero(wide), other = hn::Zero(wide);
        auto count = hn::Zero(d);
        for (; i + lanes <= stop; i += lanes) {
            hwy::Prefetch(from + i + kAhead / sizeof(*from));
            const auto v = hn::Xor(hn::LoadU(d, from + i), turned);
            low = hn::Min(low, v);
            high = hn::Max(high, v);
            count = hn::Sub(count, hn::VecFromMask(d, hn::Eq(v, wanted)));
            sum = hn::ReorderWidenMulAccumulate(wide, v, one, sum, other);
        }
        found.sum += sum_of(wide, sum) + sum_of(wide, other);
        found.equal += sum_of(d, count);
    }
    if (i > 0) {
        found.low = least_of(d, low);
        found.high = greatest_of(d, high);
    }
    return i;
}

/// Lanes as above. @return how many values were looked at
template <class L>
std::int64_t below_vectors(const L* from, std::int64_t n, L flip, L bound, std::int64_t& below) {
    const hn::ScalableTag<L> d;
    const auto lanes = static_cast<std::int64_t>(hn::Lanes(d));
    const auto turned = hn::Set(d, flip), limit = hn::Set(d, bound);
    std::int64_t i = 0;
    while (i + lanes <= n) {
        const std::int64_t stop = std::min(n, i + (sizeof(L) == 1 ? 255 : 32767) * lanes);
        auto count = hn::Zero(d);
        for (; i + lanes <= stop; i += lanes) {
            const auto v = hn::Xor(hn::LoadU(d, from + i), turned);
            count = hn::Sub(count, hn::VecFromMask(d, hn::Lt(v, limit)));
        }
        below += sum_of(d, count);
    }
    return i;
}

#endif

/// Numbers of up to 16 bits as vectors compare them on any processor: unsigned bytes, signed words.
template <class T>
struct Levels {
    using Lane = std::conditional_t<sizeof(T) == 1, std::uint8_t, std::int16_t>;
    static constexpr bool kTurned = std::is_signed_v<T> != std::is_signed_v<Lane>;
    static constexpr int kHalf = 1 << (8 * sizeof(T) - 1);
    static constexpr int kBack = !kTurned ? 0 : std::is_signed_v<T> ? -kHalf : kHalf;
    static constexpr auto kFlip = static_cast<Lane>(kTurned ? kHalf : 0);

    static Lane lane_of(T value) { return static_cast<Lane>(value - kBack); }
    static const Lane* lanes(const T* stored) { return reinterpret_cast<const Lane*>(stored); }
};

template <class T>
Tally tally_of_levels(const T* stored, std::int64_t n, T common, LaneSums& sums) {
    using L = Levels<T>;
    Counted found;
    for (std::int64_t i = count_vectors(L::lanes(stored), n, L::kFlip, L::lane_of(common), found);
         i < n; ++i) {
        const int value = L::lane_of(stored[i]);
        found.low = std::min(found.low, value);
        found.high = std::max(found.high, value);
        found.sum += value;
        found.equal += stored[i] == common;
    }
    sums[0] += static_cast<double>(found.sum + L::kBack * n);
    return {static_cast<double>(found.low) + L::kBack, static_cast<double>(found.high) + L::kBack,
            n, found.equal};
}

template <class T>
std::int64_t levels_below(const T* stored, std::int64_t n, T bound) {
    using L = Levels<T>;
    std::int64_t below = 0;
    for (std::int64_t i = below_vectors(L::lanes(stored), n, L::kFlip, L::lane_of(bound), below);
         i < n; ++i)
        below += stored[i] < bound;
    return below;
}

using Doubles = hn::CappedTag<double, kLanes>;

template <class T>
constexpr double kGreatest = static_cast<double>(std::numeric_limits<T>::max());
template <>
constexpr double kGreatest<StoredHalf> = 65504;

template <class V>
HWY_INLINE hn::Vec<Doubles> widened(V v) {
    const Doubles d;
    using L = hn::TFromV<V>;
    if constexpr (std::is_same_v<L, double>) {
        return v;
    } else if constexpr (std::is_same_v<L, std::uint32_t>) {
        // As signed numbers, which every processor converts; both steps are exact.
        const hn::Rebind<std::int32_t, Doubles> signs;
        const hn::Rebind<std::uint32_t, Doubles> bits;
        const auto turned = hn::Xor(v, hn::Set(bits, 0x80000000u));
        return hn::Add(hn::PromoteTo(d, hn::BitCast(signs, turned)), hn::Set(d, 0x1p31));
    } else {
        return hn::PromoteTo(d, v);
    }
}

/// Whether a value is finite, as a mask.
template <class T, class D>
HWY_INLINE hn::Mask<D> finite(D d, hn::Vec<D> v) {
    // NaN compares false. A half's infinity is widened to infinity or 65536, as processors do.
    return hn::Le(hn::Abs(v), hn::Set(d, static_cast<hn::TFromD<D>>(kGreatest<T>)));
}

/// Adds the lanes of a vector to as many sums as there are.
template <class V>
HWY_INLINE void add_lanes(V v, hn::Vec<Doubles>* sums) {
    constexpr std::size_t kWhole = hn::MaxLanes(hn::DFromV<V>());
    constexpr std::size_t kPart = hn::MaxLanes(Doubles());
    if constexpr (kWhole == kPart) {
        sums[0] = hn::Add(sums[0], widened(v));
    } else {
#if HWY_TARGET != HWY_SCALAR  // which has no halves
        const hn::Half<hn::DFromV<V>> half;
        sums[0] = hn::Add(sums[0], widened(hn::LowerHalf(half, v)));
        sums[1] = hn::Add(sums[1], widened(hn::UpperHalf(half, v)));
#endif
    }
}

/// A stretch of numbers whose sums are not exact.
template <class T>
class WideTally {
 public:
    explicit WideTally(Lane<T> common) : common_(common) {}

    /// @return how many values were added: a multiple of kLanes
    std::int64_t add(const T* stored, std::int64_t n, LaneSums& sums) {
        const D d;
        hn::Vec<Doubles> total[kSums];
        for (std::size_t k = 0; k < kSums; ++k)
            total[k] = hn::LoadU(Doubles(), sums.data() + k * kInSum);
        const auto wanted = hn::Set(d, common_);
        const auto greatest = hn::Set(d, static_cast<Lane<T>>(kGreatest<T>));
        const auto least = hn::Set(d, std::numeric_limits<Lane<T>>::lowest());
        auto low = greatest, high = least;
        auto not_finite = hn::Zero(Bits()), equal = hn::Zero(Bits());
        std::int64_t i = 0;
        for (; i + kLanes <= n; i += kLanes) {
            hwy::Prefetch(reinterpret_cast<const char*>(stored + i) + kAhead);
            for (std::size_t part = 0; part < kLanes / kInVector; ++part) {
                const auto v = load(d, stored + i + part * kInVector);
                equal = hn::Sub(equal, ones(hn::Eq(v, wanted)));
                auto* to = total + part * kInVector / kInSum;
                if constexpr (kFloats) {
                    const auto good = finite<T>(d, v);
                    low = hn::Min(low, hn::IfThenElse(good, v, greatest));
                    high = hn::Max(high, hn::IfThenElse(good, v, least));
                    not_finite = hn::Sub(not_finite, ones(hn::Not(good)));
                    add_lanes(hn::IfThenElseZero(good, v), to);
                } else {
                    low = hn::Min(low, v);
                    high = hn::Max(high, v);
                    add_lanes(v, to);
                }
            }
        }
        for (std::size_t k = 0; k < kSums; ++k)
            hn::StoreU(total[k], Doubles(), sums.data() + k * kInSum);
        found_ = {static_cast<double>(least_of(d, low)), static_cast<double>(greatest_of(d, high)),
                  i - sum_of(Bits(), not_finite), sum_of(Bits(), equal)};
        return i;
    }

    Tally finish(const T* rest, std::int64_t n, LaneSums& sums) {
        for (std::int64_t lane = 0; lane < n; ++lane) {
            const double value = as_double(rest[lane]);
            found_.equal += value == static_cast<double>(common_);
            if (!std::isfinite(value)) continue;
            found_.low = std::min(found_.low, value);
            found_.high = std::max(found_.high, value);
            sums[static_cast<std::size_t>(lane)] += value;
            ++found_.finite;
        }
        return found_;
    }

 private:
    using D = hn::CappedTag<Lane<T>, kLanes>;
    using Bits = hn::RebindToSigned<D>;
    static constexpr bool kFloats = std::is_floating_point_v<Lane<T>>;
    static constexpr std::size_t kInVector = hn::MaxLanes(D()), kInSum = hn::MaxLanes(Doubles());
    static constexpr std::size_t kSums = kLanes / kInSum;

    static HWY_INLINE hn::Vec<Bits> ones(hn::Mask<D> mask) {
        return hn::BitCast(Bits(), hn::VecFromMask(D(), mask));
    }

    Lane<T> common_;
    Tally found_{};
};

Tally TallyOf(const Stretched& values, double common, LaneSums& sums) {
    const std::int64_t n = values.last - values.first;
    return with_stored_type(values.type, [&](auto zero) HWY_ATTR {
        using T = decltype(zero);
        const T* stored = static_cast<const T*>(values.stored) + values.first;
        if constexpr (std::is_integral_v<T> && sizeof(T) <= 2) {
            return tally_of_levels(stored, n, static_cast<T>(common), sums);
        } else {
            WideTally<T> wide(static_cast<Lane<T>>(common));
            const std::int64_t done = wide.add(stored, n, sums);
            return wide.finish(stored + done, n - done, sums);
        }
    });
}

void CountBelow(const Stretched& values, std::span<const double> bounds,
                std::span<std::int64_t> below) {
    with_stored_type(values.type, [&](auto zero) HWY_ATTR {
        using T = decltype(zero);
        if constexpr (std::is_integral_v<T> && sizeof(T) <= 2)
            for (std::size_t k = 0; k < bounds.size(); ++k)
                below[k] += levels_below(static_cast<const T*>(values.stored) + values.first,
                                         values.last - values.first, static_cast<T>(bounds[k]));
    });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace edgewise
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise {

HWY_EXPORT(TallyOf);
HWY_EXPORT(CountBelow);

Tally tally(const Stretched& values, double common, LaneSums& sums) {
    return HWY_DYNAMIC_DISPATCH(TallyOf)(values, common, sums);
}

void count_below(const Stretched& values, std::span<const double> bounds,
                 std::span<std::int64_t> below) {
    if (!bounds.empty()) HWY_DYNAMIC_DISPATCH(CountBelow)(values, bounds, below);
}

}  // namespace edgewise
#endif
