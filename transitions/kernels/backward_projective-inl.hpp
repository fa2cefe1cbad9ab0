// Rows of the backward warp of images by projective maps, compiled once a target (Highway's
// foreach_target). No pragma once: the guard toggles, so that every target sees the text once.
#if defined(EDGEWISE_BACKWARD_PROJECTIVE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef EDGEWISE_BACKWARD_PROJECTIVE_INL
#undef EDGEWISE_BACKWARD_PROJECTIVE_INL
#else
#define EDGEWISE_BACKWARD_PROJECTIVE_INL
#endif

#include <algorithm>
#include <array>
#include <cstdint>

#include "hwy/highway.h"
#include "transitions/kernels/backward-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels {
namespace HWY_NAMESPACE {

/// Sixteen positions of a projective row, in f64: a quotient cannot be continued from its
/// neighbour.
struct ProjectedBlock {
    alignas(64) std::array<std::array<std::int32_t, kBlock>, 2> cell;
    alignas(64) std::array<std::array<float, kBlock>, 2> fraction;
    alignas(64) std::array<std::int32_t, kBlock> seen;  // 1 or 0
    bool any = false;
};

HWY_INLINE void project(const BackwardPlan& plan, std::int64_t x, std::int64_t y,
                        ProjectedBlock& block) {
    const hn::CappedTag<double, kBlock> d;
    const hn::Rebind<float, decltype(d)> narrow;
    const hn::Rebind<std::int32_t, decltype(d)> whole;
    const Homography& h = plan.homography;
    const auto shift = hn::Set(d, plan.hold == Hold::zoh ? 0.5 : 0.0);
    block.any = false;
    for (int lane = 0; lane < kBlock; lane += int(hn::Lanes(d))) {
        const auto column = hn::Iota(d, double(x + lane));
        const auto form = [&](int row) HWY_ATTR {
            const double rest = h[3 * row + 1] * double(y) + h[3 * row + 2];
            return hn::MulAdd(hn::Set(d, h[3 * row]), column, hn::Set(d, rest));
        };
        const auto w = form(2);
        auto seen = hn::Gt(w, hn::Zero(d));
        const decltype(w) place[2] = {hn::Div(form(0), w), hn::Div(form(1), w)};
        for (int a = 0; a < 2; ++a) {
            const Range range = seen_range(plan.extent[a]);
            seen = hn::And(seen, hn::And(hn::Ge(place[a], hn::Set(d, range.low)),
                                         hn::Le(place[a], hn::Set(d, range.high))));
        }
        for (int a = 0; a < 2; ++a) {
            const auto p = hn::IfThenElseZero(seen, hn::Add(place[a], shift));
            const auto cell = hn::Floor(p);
            hn::StoreU(hn::DemoteTo(whole, cell), whole, block.cell[a].data() + lane);
            hn::StoreU(hn::DemoteTo(narrow, hn::Sub(p, cell)), narrow,
                       block.fraction[a].data() + lane);
        }
        hn::StoreU(hn::DemoteTo(whole, hn::IfThenElseZero(seen, hn::Set(d, 1.0))), whole,
                   block.seen.data() + lane);
        block.any = block.any || !hn::AllFalse(d, seen);
    }
}

template <class Read, Hold kHold, bool kNeighbours>
void projective_row(const BackwardPlan& plan, std::int64_t y, Span columns, float* row) {
    const Floats d;
    const Ints di;
    const int channels = plan.input.channels;
    ProjectedBlock block;
    for (std::int64_t x = columns.begin; x < columns.end; x += kBlock) {
        project(plan, x, y, block);
        const std::int64_t count = std::min<std::int64_t>(kBlock, columns.end - x);
        if (!block.any) {
            fill_columns(plan, row, x, x + count);
            continue;
        }
        for (int c = 0; c < channels; ++c) {
            alignas(64) float values[kBlock];
            const auto* base = plan.input.as<std::uint8_t>() + c * Read::kBytes;
            for (int lane = 0; lane < kBlock; lane += int(hn::Lanes(d))) {
                Places<2> at;
                for (int a = 0; a < 2; ++a) {
                    at.cell[a] = hn::Load(di, block.cell[a].data() + lane);
                    at.fraction[a] = hn::Load(d, block.fraction[a].data() + lane);
                }
                const VF value =
                    border_value<Read, kHold, 2, kNeighbours>(plan, base, {0, 0, 0}, at);
                const auto seen = hn::Gt(hn::Load(di, block.seen.data() + lane), hn::Zero(di));
                hn::Store(hn::IfThenElse(hn::RebindMask(d, seen), mapped_value(plan, value),
                                         hn::Set(d, plan.outside)),
                          d, values + lane);
            }
            for (std::int64_t k = 0; k < count; ++k) row[(x + k) * channels + c] = values[k];
        }
    }
}

template <class Read, Hold kHold, bool kNeighbours>
void projective_region(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    for (std::int64_t z = region.begin[2]; z < region.end[2]; ++z)
        for (std::int64_t y = region.begin[1]; y < region.end[1]; ++y)
            projective_row<Read, kHold, kNeighbours>(plan, y, {region.begin[0], region.end[0]},
                                                     row_of(plan, output, y, z));
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels
HWY_AFTER_NAMESPACE();

#endif
