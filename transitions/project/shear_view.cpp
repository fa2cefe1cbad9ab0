#include "transitions/project/shear_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "transitions/kernels/backward.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {

ShearView shear_view_of(const Representation& from, const Request& want, int view) {
    const kernels::Rays rays = rays_of(from, want, view);
    const auto& d = rays.direction.base;
    const Extent& n = from.extent;
    ShearView f;
    f.dx = d[0] / d[2];
    f.dy = d[1] / d[2];
    f.step = 1 / std::abs(d[2]);
    f.backwards = d[2] < 0;
    // Slices 0 ... nz - 1 and half a spacing beyond reach over these pixels.
    const auto frame = [&](double shear, std::int64_t along, double& first, std::int64_t& size) {
        const double low = -0.5 * shear, high = (static_cast<double>(n.z) - 0.5) * shear;
        const double nearest = f.backwards ? static_cast<double>(n.z - 1) * shear : 0;
        first = std::floor(-0.5 - std::max(low, high) + nearest) - 1 - nearest;
        const double last = static_cast<double>(along) - 0.5 - std::min(low, high);
        size = static_cast<std::int64_t>(std::ceil(last) - first) + 2;
    };
    frame(f.dx, n.x, f.x, f.image.x);
    frame(f.dy, n.y, f.y, f.image.y);
    // Where a pixel's ray crosses slice 0.
    const auto row = [&](int axis, double shear, double first, int at) {
        const auto crossing = [&](const std::array<double, 3>& p) {
            return p[axis] - p[2] * shear;
        };
        f.to_image[at] = crossing(rays.origin.x);
        f.to_image[at + 1] = crossing(rays.origin.y);
        f.to_image[at + 3] = crossing(rays.origin.base) - first;
    };
    row(0, f.dx, f.x, 0);
    row(1, f.dy, f.y, 4);
    f.to_image[10] = 1;
    return f;
}

kernels::ShearWarp shear_warp_of(const ShearView& f, const Data& in, const Request& want,
                                 const kernels::Optics& optics, kernels::Hold hold) {
    kernels::ShearWarp warp{.volume = rule_grid(in, want),
                            .hold = hold,
                            .with = combining_of(want, in.what.values, optics),
                            .x = f.x,
                            .dx = f.dx,
                            .y = f.y,
                            .dy = f.dy,
                            .backwards = f.backwards};
    warp.with.step = f.step;
    return warp;
}

Region from_multiple(Region box, std::int64_t each) {
    box.begin[0] -= box.begin[0] % each;
    return box;
}

Region box_of_image(const ShearView& f, const Region& picture) {
    // The kernel works out columns in blocks, of which some may lie beside the region.
    constexpr std::int64_t kBlock = kernels::kBackwardBlock;
    Region out = from_multiple(picture, kBlock);
    out.end[0] = (out.end[0] + kBlock - 1) / kBlock * kBlock;
    Region box = Region::all(f.image);
    for (int axis = 0; axis < 2; ++axis) {
        const double* m = &f.to_image[static_cast<std::size_t>(4 * axis)];
        double low = m[3], high = low;
        for (int k = 0; k < 2; ++k) {
            const double p = m[k] * static_cast<double>(out.begin[k]);
            const double q = m[k] * static_cast<double>(out.end[k] - 1);
            low += std::min(p, q);
            high += std::max(p, q);
        }
        const auto last = static_cast<double>(f.image[axis] - 1);
        box.begin[axis] = static_cast<std::int64_t>(std::clamp(std::floor(low - 1), 0.0, last));
        box.end[axis] = static_cast<std::int64_t>(std::clamp(std::ceil(high + 1), 0.0, last)) + 1;
    }
    return box;
}

}  // namespace edgewise
