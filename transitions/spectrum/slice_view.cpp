#include "transitions/spectrum/slice_view.hpp"

#include "transitions/kernels/grid_of.hpp"

namespace edgewise {

kernels::SliceView slice_view(const Mat4& to_screen, const Extent& slice, const Request& want,
                              std::string_view band) {
    const std::int64_t width = 2 * (slice.x - 1);
    return {.to_screen = kernels::affine_of(to_screen),
            .width = width,
            .height = slice.y,
            .between = want.field == Field::linear   ? kernels::Between::linear
                       : want.field == Field::spline ? kernels::Between::spline
                                                     : kernels::Between::band,
            .folded = band == "volume",
            .scale = want.unit / (static_cast<double>(width) * static_cast<double>(slice.y))};
}

}  // namespace edgewise
