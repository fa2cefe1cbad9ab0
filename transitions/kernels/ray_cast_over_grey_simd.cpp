// Ray casting: front-to-back compositing, grey.
#include "transitions/kernels/ray_cast_tiles.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "transitions/kernels/ray_cast_over_grey_simd.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "transitions/kernels/ray_cast-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace edgewise::kernels::HWY_NAMESPACE {
namespace {

template <bool kFinite>
using Sum = OverSum<kFinite, 1>;

void cast_tile_over_grey(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                         std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    cast_tile<Sum>({cast, x, y, width, height, out, row_floats});
}

}  // namespace
}  // namespace edgewise::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace edgewise::kernels {

HWY_EXPORT(cast_tile_over_grey);

void ray_cast_over_grey(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
                        std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    HWY_DYNAMIC_DISPATCH(cast_tile_over_grey)(cast, x, y, width, height, out, row_floats);
}

}  // namespace edgewise::kernels
#endif
