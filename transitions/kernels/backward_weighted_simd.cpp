// The backward warp by filters without a kernel of their own: weights of their taps are told at run
// time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/backward_weighted_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/backward_projective-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR
void warp_weighted(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    backward_in_f64(plan, output, region);  // a vector of one lane brings nothing
}
#else
template <class Read>
void weighted_typed(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    if (plan.axes == 3) return warp_region<Read, Hold::weighted, 3, true>(plan, output, region);
    if (plan.projective)
        return projective_region<Read, Hold::weighted, false>(plan, output, region);
    if (plan.input.channels == 1)
        return warp_region<Read, Hold::weighted, 2, true>(plan, output, region);
    warp_region<Read, Hold::weighted, 2, false>(plan, output, region);
}

void warp_weighted(const BackwardPlan& plan, const WarpOutput& output, const Region& region) {
    with_reads(plan.input.type,
               [&](auto read) { weighted_typed<decltype(read)>(plan, output, region); });
}
#endif

}  // namespace HWY_NAMESPACE
}  // namespace edgewise::kernels
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(warp_weighted);

void backward_weighted_simd(const BackwardPlan& plan, const WarpOutput& output,
                            const Region& region) noexcept {
    HWY_DYNAMIC_DISPATCH(warp_weighted)(plan, output, region);
}

}  // namespace edgewise::kernels
#endif
