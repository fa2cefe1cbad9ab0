#include "transitions/kernels/ray_cast.hpp"

#include "transitions/kernels/ray_cast_tiles.hpp"

namespace edgewise::kernels {

void ray_cast(const RayCast& cast, std::int64_t x, std::int64_t y, std::int64_t width,
              std::int64_t height, float* out, std::ptrdiff_t row_floats) {
    const auto by_rule = [&] {
        switch (cast.rule) {
            case Combine::max:
                return ray_cast_max;
            case Combine::sum:
            case Combine::mean:
                return cast.light || cast.cue ? ray_cast_lit_line : ray_cast_line;
            case Combine::hit:
                return ray_cast_hit;
            case Combine::other:
                return ray_cast_other;
            case Combine::over:
                break;
        }
        if (cast.integrals) return ray_cast_integrated;
        if (cast.light || cast.cue || cast.edges || cast.table) return ray_cast_lit;
        return cast.optics->grey ? ray_cast_over_grey : ray_cast_over_color;
    }();
    by_rule(cast, x, y, width, height, out, row_floats);
}

}  // namespace edgewise::kernels
