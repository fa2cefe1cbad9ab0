#include <algorithm>
#include <bit>
#include <cstdint>

#include "reference/stored.hpp"
#include "scene/tally.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scene/widen_simd.cpp"
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

/// Finds stored values that equal a number, or that differ from it.
template <class T>
class Finder {
 public:
    /// @param last  behind the last value that may be read
    Finder(double number, const T* last) : number_(static_cast<Lane<T>>(number)), last_(last) {}

    template <bool kEqual>
    std::int64_t first(const T* stored, std::int64_t begin, std::int64_t end) const {
        for (constexpr std::int64_t lanes = hn::MaxLanes(D()); begin < end; begin += lanes) {
            const auto at = hn::FindFirstTrue(D(), found<kEqual>(stored, begin, end));
            if (at >= 0) return begin + at;
        }
        return end;
    }

    /// The place behind the last sample that differs, or 0 where none does.
    std::int64_t end_of_others(const T* stored, std::int64_t begin, std::int64_t end) const {
        for (constexpr std::int64_t lanes = hn::MaxLanes(D()); begin < end; end -= lanes) {
            const std::int64_t from = std::max(begin, end - lanes);
            std::uint64_t bits = 0;
            hn::StoreMaskBits(D(), found<false>(stored, from, end),
                              reinterpret_cast<std::uint8_t*>(&bits));
            if (bits != 0) return from + std::bit_width(bits);
        }
        return 0;
    }

 private:
    // As many halves as there are floats: they are widened.
    using D = hn::ScalableTag<Lane<T>>;

    /// Of a vector at `begin`. What is loaded behind the end does not count.
    template <bool kEqual>
    HWY_INLINE hn::Mask<D> found(const T* stored, std::int64_t begin, std::int64_t end) const {
        const D d;
        const auto inside =
            hn::FirstN(d, static_cast<std::size_t>(
                              std::min(end - begin, static_cast<std::int64_t>(hn::MaxLanes(d)))));
        const T* from = stored + begin;
        T few[hn::MaxLanes(d)] = {};
        if (last_ - from < static_cast<std::ptrdiff_t>(hn::MaxLanes(d)))
            from = std::copy(from, stored + end, few) - (end - begin);
        const auto equal = hn::Eq(load(d, from), hn::Set(d, number_));
        // NaN differs from every number; Highway's own Ne says no.
        if constexpr (kEqual)
            return hn::And(inside, equal);
        else
            return hn::AndNot(equal, inside);
    }

    Lane<T> number_;
    const T* last_;
};

/// Part of a row: x first ... last - 1 of row y in plane z.
struct Segment {
    std::int64_t first, last, y, z;
};

/// `row`: the values of the row, of which the segment is a part.
template <class T>
HWY_INLINE void widen_by(const T* row, const Segment& at, const Finder<T>& find, Region& box) {
    auto& [x0, y0, z0] = box.begin;
    auto& [x1, y1, z1] = box.end;
    if (at.y < y0 || at.y >= y1 || at.z < z0 || at.z >= z1) {
        const std::int64_t x = find.template first<false>(row, at.first, at.last);
        if (x == at.last) return;
        y0 = std::min(y0, at.y), y1 = std::max(y1, at.y + 1);
        z0 = std::min(z0, at.z), z1 = std::max(z1, at.z + 1);
        x0 = std::min(x0, x), x1 = std::max(x1, x + 1);
    }
    const std::int64_t left = std::min(at.last, x0), right = std::max(at.first, x1);
    if (at.first < left) {
        const std::int64_t x = find.template first<false>(row, at.first, left);
        if (x < left) x0 = x;
    }
    if (right < at.last) x1 = std::max(x1, find.end_of_others(row, right, at.last));
}

void Widen(const Stretched& values, const RowGrid& grid, double common, Region& box) {
    with_stored_type(values.type, [&](auto zero) HWY_ATTR {
        using T = decltype(zero);
        const Finder<T> find(common, static_cast<const T*>(values.stored) + values.last);
        const std::int64_t first_row = values.first / grid.row;
        std::int64_t begin = first_row * grid.row;
        std::int64_t y = first_row % grid.rows, z = first_row / grid.rows;
        for (; begin < values.last; begin += grid.row) {
            const Segment at{std::max<std::int64_t>(0, values.first - begin),
                             std::min(grid.row, values.last - begin), y, z};
            widen_by(static_cast<const T*>(values.stored) + begin, at, find, box);
            if (++y == grid.rows) y = 0, ++z;
        }
    });
}

std::int64_t FirstEqual(const Stretched& values, double wanted) {
    return with_stored_type(values.type, [&](auto zero) HWY_ATTR {
        using T = decltype(zero);
        const auto* stored = static_cast<const T*>(values.stored);
        return Finder<T>(wanted, stored + values.last)
            .template first<true>(stored, values.first, values.last);
    });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace edgewise
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise {

HWY_EXPORT(Widen);
HWY_EXPORT(FirstEqual);

void widen(const Stretched& values, const RowGrid& grid, double common, Region& box) {
    HWY_DYNAMIC_DISPATCH(Widen)(values, grid, common, box);
}

std::int64_t first_equal(const Stretched& values, double wanted) {
    return HWY_DYNAMIC_DISPATCH(FirstEqual)(values, wanted);
}

}  // namespace edgewise
#endif
