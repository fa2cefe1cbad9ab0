#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/backward_3d_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/backward-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels {
namespace HWY_NAMESPACE {

void warp_volume(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    with_reads(plan.input.type,
               [&](auto read) { warp_typed<decltype(read), 3, true>(plan, output, region); });
}

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(warp_volume);

void backward_3d_simd(const BackwardPlan& plan, const WarpOutput& output,
                      const Region& region) noexcept {
    HWY_DYNAMIC_DISPATCH(warp_volume)(plan, output, region);
}

}  // namespace edgewise::kernels
#endif
