#include "transitions/project/pixel_spans.hpp"

#include "transitions/kernels/ray_path.hpp"
#include "transitions/project/combine_model.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {

kernels::RayCast rays_through_input(const Request& want, int view) {
    Representation input;
    input.extent = want.input;
    kernels::RayCast rays;
    rays.volume.extent = want.input;
    rays.rays = rays_of(input, want, view);
    return rays;
}

void fill_spans(const kernels::RayCast& rays, const Region& tile, std::ptrdiff_t pitch, float* low,
                float* high) {
    for (std::int64_t y = tile.begin[1]; y < tile.end[1]; ++y)
        for (std::int64_t x = tile.begin[0]; x < tile.end[0]; ++x) {
            const kernels::RayPath path =
                ray_path(rays, static_cast<double>(x), static_cast<double>(y));
            const std::ptrdiff_t i = (y - tile.begin[1]) * pitch + (x - tile.begin[0]);
            if (!path.hit()) {
                low[i] = 1;
                high[i] = 0;
                continue;
            }
            // Cells of this path are those of z, so that first + first_offset ... tell where it is.
            const double begin =
                static_cast<double>(path.first) + 0.5 + path.first_offset - 0.5 * path.first_weight;
            const CombinedSpan span = combined_span(begin, begin + path.length);
            low[i] = span.low;
            high[i] = span.high;
        }
}

}  // namespace edgewise
