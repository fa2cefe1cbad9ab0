#include "transitions/project/parallel_product.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>

#include "transitions/project/counts.hpp"

namespace edgewise {

double state_bytes(Mode mode) noexcept {
    return mode->state_numbers * static_cast<double>(sizeof(float));
}

double shadow_of_box(const Mat4& map, const Extent& extent, const Cut& cut) {
    const auto side = [&](int axis) {
        const double n = std::ceil(static_cast<double>(extent[axis]) / cut[axis]);
        return Vec3(map.topLeftCorner<3, 3>().col(axis) * n);
    };
    double area = 0;
    for (int axis = 0; axis < 3; ++axis)
        area += std::abs(side((axis + 1) % 3).cross(side((axis + 2) % 3)).z());
    return area;
}

void add_subframes(Work& work, const Offer& offer, const Ask& ask, int view) {
    constexpr double kMostMet = 17,
                     kRay = 60;  // kRay: operations to set up a ray, as project.ray_cast
    const Representation& from = offer.from;
    const int ranks = ask.want.ranks;
    const Cut cut = cut_of(from.layout, from.extent, 3, ranks);
    const auto pixels = static_cast<double>(offer.to.samples());
    const double subframe =
        std::min(pixels, shadow_of_box(residual(from, ask.want, view), from.extent, cut));
    const double states = state_bytes(ask.want.mode), boxes = ranks;
    const double halo =
        halo_samples(from.extent, cut, 1) * from.bytes() / static_cast<double>(from.samples());
    work.operations += kRay * std::max(0.0, subframe * boxes - pixels) + 2 * subframe * boxes;
    work.workspace = work.workspace / boxes + halo + subframe * states;
    for (const int n : cut) work.traffic.messages += n > 1 ? 2 : 0;  // halos
    work.traffic.messages += std::min(kMostMet, boxes - 1);
    work.traffic.sent += halo + subframe * states;
    add_parallel_product(work, ask.want.mode, cut, pixels);
}

void add_parallel_product(Work& work, Mode mode, const Cut& cut, double pixels) {
    if (cut[2] < 2) return;
    const double own = pixels / (double(cut[0]) * cut[1]);
    // The intensities of boxes are premultiplied already, and have transparencies.
    const double colors = mode->takes_transfer ? 3 : mode->operations;
    double a_pixel = composites(cut[2]) * colors;
    if (mode->takes_transfer)
        a_pixel = composites(cut[2]) * 2 * colors +
                  transparency_updates(Compositing::tree_from_front, cut[2]);
    work.operations += a_pixel * pixels;
    work.traffic.messages += std::bit_width(static_cast<unsigned>(cut[2] - 1));
    work.traffic.sent += own * state_bytes(mode) * (1 - 1.0 / cut[2]);
    work.workspace += own * state_bytes(mode);
}

}  // namespace edgewise
