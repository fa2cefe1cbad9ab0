// Extremes and sums of rows, for octrees.
#include <limits>

#include "transitions/kernels/octree_rows.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/octree_rows_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using SumTag = hn::CappedTag<double, 8>;
using RowTag = hn::Rebind<float, SumTag>;

/// Each product and sum rounds by itself, so that all processors agree.
void add_octree_row_on(const float* row, double weight, const OctreeSums& to) {
    const RowTag f;
    const SumTag d;
    static_assert(kOctreeLanes % hn::MaxLanes(RowTag()) == 0);
    const auto none = hn::Set(f, std::numeric_limits<float>::infinity());
    const auto largest = hn::Set(f, std::numeric_limits<float>::max());
    const auto origin = hn::Set(d, static_cast<double>(to.origin)), by = hn::Set(d, weight);
    for (std::size_t x = 0; x < to.n; x += hn::Lanes(f)) {
        const auto value = hn::LoadU(f, row + x);
        const auto finite = hn::Le(hn::Abs(value), largest);
        hn::StoreU(hn::Min(hn::LoadU(f, to.low + x), hn::IfThenElse(finite, value, none)), f,
                   to.low + x);
        hn::StoreU(hn::Max(hn::LoadU(f, to.high + x), hn::IfThenElse(finite, value, hn::Neg(none))),
                   f, to.high + x);
        hn::StoreU(hn::Add(hn::LoadU(f, to.gaps + x), hn::IfThenZeroElse(finite, hn::Set(f, 1.0f))),
                   f, to.gaps + x);
        if (!to.sum) continue;
        const auto kept = hn::IfThenElse(finite, value, hn::Set(f, to.origin));
        const auto off = hn::Sub(hn::PromoteTo(d, kept), origin);
        const auto weighed = hn::Mul(by, off);
        hn::StoreU(hn::Add(hn::LoadU(d, to.sum + x), weighed), d, to.sum + x);
        hn::StoreU(hn::Add(hn::LoadU(d, to.squares + x), hn::Mul(weighed, off)), d, to.squares + x);
    }
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(add_octree_row_on);

void add_octree_row(const float* row, double weight, const OctreeSums& to) {
    HWY_DYNAMIC_DISPATCH(add_octree_row_on)(row, weight, to);
}

}  // namespace edgewise::kernels
#endif
