#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/backward_2d_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/backward_projective-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels {
namespace HWY_NAMESPACE {

template <class Read, bool kNeighbours>
void image_typed(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    if (!plan.projective) return warp_typed<Read, 2, kNeighbours>(plan, output, region);
    if (plan.hold == Hold::zoh)
        return projective_region<Read, Hold::zoh, kNeighbours>(plan, output, region);
    if (plan.hold == Hold::foh)
        return projective_region<Read, Hold::foh, kNeighbours>(plan, output, region);
    if constexpr (Read::kFloats)
        projective_region<Read, Hold::bspline3, kNeighbours>(plan, output, region);
}

void warp_image(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    with_reads(plan.input.type, [&](auto read) {
        using Read = decltype(read);
        if (plan.input.channels == 1) return image_typed<Read, true>(plan, output, region);
        image_typed<Read, false>(plan, output, region);
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
