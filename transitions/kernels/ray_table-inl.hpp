// Tables of opacity and colour on vectors of samples. Compiled once a target: see Highway's
// foreach_target.h.
#if defined(EDGEWISE_RAY_TABLE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_RAY_TABLE_INL
#undef EDGEWISE_RAY_TABLE_INL
#else
#define EDGEWISE_RAY_TABLE_INL
#endif

#include "hwy/highway.h"
#include "transitions/kernels/optics-inl.hpp"
#include "transitions/kernels/ray_table.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

/// Where numbers lie along an axis: between knots `cell` and the next one.
struct TablePlace {
    VI cell;
    VF share;
};

/// Of numbers that are no numbers the first place.
HWY_INLINE TablePlace place_in(const RayTable::Axis& axis, VF at) {
    const DF d;
    const DI di;
    const VF first = hn::Set(d, axis.low());
    at = hn::IfThenElse(hn::Ge(at, first), hn::Min(at, hn::Set(d, axis.high())), first);
    const float* const knots = axis.knots.data();
    VI cell = hn::Zero(di);
    for (int step = axis.first_step; step > 0; step /= 2) {
        const VI next = hn::Add(cell, hn::Set(di, step));
        const MF reached = hn::Ge(at, hn::GatherIndex(d, knots, next));
        cell = hn::IfThenElse(hn::RebindMask(di, reached), next, cell);
    }
    cell = hn::Min(cell, hn::Set(di, axis.count - 2));
    const VF low = hn::GatherIndex(d, knots, cell),
             high = hn::GatherIndex(d, knots, hn::Add(cell, hn::Set(di, 1)));
    const VF share = hn::Div(hn::Sub(at, low), hn::Sub(high, low));
    return {cell, hn::IfThenElse(hn::Ge(at, high), hn::Set(d, 1.0f), share)};
}

/// The largest opacity of values, over all gradients; 0 where rays need no gradient.
HWY_INLINE VF most_at(const RayTable& table, const TablePlace& value) {
    const DF d;
    const float* const most = table.most.data();
    return between(hn::GatherIndex(d, most, value.cell),
                   hn::GatherIndex(d, most, hn::Add(value.cell, hn::Set(DI(), 1))), value.share);
}

/// Colours and opacities of values and gradients of stored numbers.
[[maybe_unused]] HWY_NOINLINE VF table_at(const RayTable& table, const TablePlace& value,
                                          const VF (&gradient)[3], VF (&color)[3]) {
    const DF d;
    const DI di;
    VF square = hn::Zero(d);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const VF along = hn::Mul(gradient[axis], hn::Set(d, table.per_length[axis]));
        square = hn::MulAdd(along, along, square);
    }
    const TablePlace down = place_in(table.gradients, hn::Sqrt(square));
    const int row = 4 * table.values.count;
    const VI corner = hn::Add(hn::Mul(down.cell, hn::Set(di, row)), hn::ShiftLeft<2>(value.cell));
    const auto part = [&](int c) HWY_ATTR {
        const auto at = [&](int offset) HWY_ATTR {
            return hn::GatherIndex(d, table.cells.data(), hn::Add(corner, hn::Set(di, offset + c)));
        };
        return between(between(at(0), at(4), value.share),
                       between(at(row), at(row + 4), value.share), down.share);
    };
    for (int c = 0; c < 3; ++c) color[c] = part(c);
    return hn::Min(hn::Max(part(3), hn::Zero(d)), hn::Set(d, 1.0f));
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
