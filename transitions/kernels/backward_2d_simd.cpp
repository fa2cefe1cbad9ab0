#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/backward_2d_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/backward-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels {
namespace HWY_NAMESPACE {

/// Sixteen positions of a projective row, in f64: a quotient cannot be continued from its neighbour.
struct ProjectedBlock {
    alignas(64) std::array<std::array<std::int32_t, kBlock>, 2> cell;
    alignas(64) std::array<std::array<float, kBlock>, 2> fraction;
    std::array<bool, kBlock> seen;
    bool any = false;
};

ProjectedBlock project(const BackwardPlan& plan, std::int64_t x, std::int64_t y) {
    const Homography& h = plan.homography;
    const Range seen[2] = {seen_range(plan.extent[0]), seen_range(plan.extent[1])};
    const double shift = plan.hold == Hold::zoh ? 0.5 : 0;
    const double u = h[1] * double(y) + h[2], v = h[4] * double(y) + h[5];
    const double w0 = h[7] * double(y) + h[8];
    ProjectedBlock block;
    for (int lane = 0; lane < kBlock; ++lane) {
        const double column = double(x + lane), w = h[6] * column + w0;
        const double place[2] = {(h[0] * column + u) / w, (h[3] * column + v) / w};
        bool inside = w > 0;
        for (int a = 0; a < 2; ++a)
            inside = inside && place[a] >= seen[a].low && place[a] <= seen[a].high;
        for (int a = 0; a < 2; ++a) {
            const double p = inside ? place[a] + shift : 0;
            const double cell = std::floor(p);
            block.cell[a][lane] = std::int32_t(cell);
            block.fraction[a][lane] = float(p - cell);
        }
        block.seen[lane] = inside;
        block.any = block.any || inside;
    }
    return block;
}

template <class T, Hold kHold>
void projective_row(const BackwardPlan& plan, std::int64_t y, Span columns, float* row) {
    const Floats d;
    const Ints di;
    const int channels = plan.input.channels;
    for (std::int64_t x = columns.begin; x < columns.end; x += kBlock) {
        const ProjectedBlock block = project(plan, x, y);
        const std::int64_t count = std::min<std::int64_t>(kBlock, columns.end - x);
        if (!block.any) {
            fill_columns(plan, row, x, x + count);
            continue;
        }
        for (int c = 0; c < channels; ++c) {
            alignas(64) float values[kBlock];
            for (int lane = 0; lane < kBlock; lane += int(hn::Lanes(d))) {
                Places<2> at;
                for (int a = 0; a < 2; ++a) {
                    at.cell[a] = hn::Load(di, block.cell[a].data() + lane);
                    at.fraction[a] = hn::Load(d, block.fraction[a].data() + lane);
                }
                const auto* base = plan.input.as<std::uint8_t>() + c * sizeof(T);
                const VF value = border_value<T, kHold, 2>(plan, base, {0, 0, 0}, at);
                hn::Store(mapped_value(plan, value), d, values + lane);
            }
            for (std::int64_t k = 0; k < count; ++k)
                row[(x + k) * channels + c] = block.seen[k] ? values[k] : plan.outside;
        }
    }
}

template <class T, Hold kHold>
void projective_region(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    for (std::int64_t z = region.begin[2]; z < region.end[2]; ++z)
        for (std::int64_t y = region.begin[1]; y < region.end[1]; ++y)
            projective_row<T, kHold>(plan, y, {region.begin[0], region.end[0]},
                                     row_of(plan, output, y, z));
}

template <class T>
void projective_typed(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    if (plan.hold == Hold::zoh) return projective_region<T, Hold::zoh>(plan, output, region);
    if (plan.hold == Hold::foh) return projective_region<T, Hold::foh>(plan, output, region);
    if constexpr (std::is_same_v<T, float>)
        projective_region<T, Hold::bspline3>(plan, output, region);
}

void warp_image(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    with_type(plan.input.type, [&](auto sample) {
        using T = decltype(sample);
        if (plan.projective) return projective_typed<T>(plan, output, region);
        if (plan.input.channels == 1) return warp_typed<T, 2, true>(plan, output, region);
        warp_typed<T, 2, false>(plan, output, region);
    });
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(warp_image);

void backward_2d_simd(const BackwardPlan& plan, const WarpOutput& output,
                      const Region& region) noexcept {
    HWY_DYNAMIC_DISPATCH(warp_image)(plan, output, region);
}

}  // namespace edgewise::kernels
#endif
