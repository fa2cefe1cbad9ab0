#include "transitions/project/splat_view.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "graph/spread.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/filters/read_by.hpp"
#include "transitions/project/picture.hpp"

namespace edgewise {

const Filter& splat_kernel() { return field_filter(Field::linear); }

std::uint32_t fixed_place(double voxels) noexcept {
    return static_cast<std::uint32_t>(
        std::llround(voxels * static_cast<double>(1 << kernels::kPlaceBits)));
}

double SplatView::pixels_written() const noexcept {
    // A vector of eight holds two rows of four, or a part of one row.
    const auto up = [](int n, int whole) { return (n + whole - 1) / whole * whole; };
    const auto& [across, down] = splat.patch;
    return across <= 4 ? 4.0 * up(down, 2) : static_cast<double>(up(across, 8)) * down;
}

SplatView splat_view_of(const Representation& from, const Request& want, int view, int cells,
                        kernels::Footprints::Depth depth) {
    const kernels::Rays rays = rays_of(from, want, view);
    const auto& d = rays.direction.base;
    SplatView made;
    kernels::Footprints::Shape& shape = made.shape;
    shape.cells = cells;
    shape.depth = depth;
    for (const int axis : {1, 0})
        if (std::abs(d[static_cast<std::size_t>(axis)]) >
            std::abs(d[static_cast<std::size_t>(shape.along)]))
            shape.along = axis;
    shape.across = {shape.along == 0 ? 1 : 0, shape.along == 2 ? 1 : 2};
    const auto along = static_cast<std::size_t>(shape.along);
    made.slice = 1 / std::abs(d[along]);
    for (std::size_t i = 0; i < 2; ++i) {
        const auto axis = static_cast<std::size_t>(shape.across[i]);
        const double slope = d[axis] / d[along];
        shape.slopes[i] = slope;
        // A ray crosses slice k at o + (k - o_along) slope.
        const auto crossing = [&](const std::array<double, 3>& o) {
            return o[axis] - slope * o[along];
        };
        kernels::FixedPlace& place = made.splat.across[i];
        // From the table's first entry, and half a cell more: the nearest one is taken.
        const double middle = (shape.places(static_cast<int>(i)) / 2 + 0.5) / shape.cells;
        place.base = fixed_place(crossing(rays.origin.base) + middle);
        place.px = fixed_place(crossing(rays.origin.x));
        place.py = fixed_place(crossing(rays.origin.y));
        place.voxel[along] = fixed_place(slope);
        place.voxel[axis] = fixed_place(-1);
        made.step[i] =
            std::max(std::abs(crossing(rays.origin.x)), std::abs(crossing(rays.origin.y)));
    }
    const Mat4 map = residual(from, want, view);
    for (int i = 0; i < 2; ++i) {
        const auto side = static_cast<std::size_t>(i);
        kernels::PlaceOnScreen& place = made.splat.screen[side];
        place.base = map(i, 3);
        double reach = 0, moved = 0;
        for (int axis = 0; axis < 3; ++axis) {
            place.voxel[static_cast<std::size_t>(axis)] = map(i, axis);
            reach += std::abs(map(i, axis)) * (from.extent[axis] == 1 ? 0.5 : 1);
            if (axis != shape.along) moved += std::abs(map(i, axis));
        }
        // Half a cell, and what places in fixed point are off by after 2^13 pixels and voxels.
        reach += (0.5 / shape.cells + 0.01) * moved;
        constexpr double kMost = 1e6;  // refused, see below
        made.splat.reach[side] = reach;
        made.splat.patch[side] = static_cast<int>(std::floor(std::min(2 * reach, kMost))) + 1;
    }
    return made;
}

namespace {

/// Why footprints of a view are too large or too small, or "".
std::string no_footprints(const Representation& from, const Request& want, int view) {
    constexpr double kWidest = 64, kFarthest = 2048;
    const SplatView of = splat_view_of(from, want, view, 1, kernels::Footprints::Depth::whole);
    const double widest = 2 * std::max(of.splat.reach[0], of.splat.reach[1]);
    if (!(widest <= kWidest))
        return fmt::format("view {}: a footprint is {:.3g} pixels wide; at most {}", view, widest,
                           kWidest);
    // Places wrap around at twice as far, and vectors reach beyond a footprint.
    const double pixels = of.splat.patch[0] + of.splat.patch[1] + 20;
    const double apart = pixels * std::max(of.step[0], of.step[1]);
    if (!(apart <= kFarthest))
        return fmt::format("view {}: pixels written at once lie within {:.4g} voxels; at most {}",
                           view, apart, kFarthest);
    return {};
}

}  // namespace

std::string no_splatting(const Representation& from, const Ask& ask) {
    const Request& want = ask.want;
    if (std::string reason = no_picture(from, ask); !reason.empty()) return reason;
    if (want.eye) return "the eye is at a finite distance: footprints differ by voxel";
    if (std::string reason = no_slices(want); !reason.empty()) return reason;
    if (!is_whole(from)) return "footprints of one picture are added in one memory";
    if (std::string reason = not_read_by(splat_kernel(), {.labels = want.field == Field::nearest});
        !reason.empty())
        return reason;
    if (ask.scene.non_finite > 0)
        return fmt::format(
            "{} samples are not finite: rays would miss all that is interpolated from them",
            ask.scene.non_finite);
    for (int variant = 0; variant < want.views.different(); ++variant)
        if (std::string reason = no_footprints(from, want, want.views.first_view(variant));
            !reason.empty())
            return reason;
    return {};
}

double SplatSpans::bytes(const Extent& volume) noexcept {
    return static_cast<double>(sizeof(kernels::SplatSpan)) * static_cast<double>(volume.y) *
           static_cast<double>(volume.z);
}

SplatSpans::SplatSpans(const kernels::Splat& splat, const Context& context)
    : spans_(static_cast<std::size_t>(splat.volume.extent.y * splat.volume.extent.z),
             context.memory) {
    tbb::parallel_for(std::int64_t{0}, splat.volume.extent.z, [&](std::int64_t z) {
        if (!context.stopped()) kernels::find_spans(splat, z, z + 1, spans_.data());
    });
    context.poll();
}

double samples_splatted(const Representation& from, const Ask& ask) {
    return std::min(static_cast<double>(from.samples()),
                    ask.scene.occupied_fraction * static_cast<double>(ask.want.input.samples()));
}

EmptySample empty_sample(const ValueMap& values, const Scene& scene) {
    EmptySample empty;
    if (values.slope != 0)
        empty.stored = static_cast<float>((scene.commonest - values.offset) / values.slope);
    if (!std::isfinite(empty.stored)) empty.stored = 0;
    empty.value = values(static_cast<double>(empty.stored));
    return empty;
}

}  // namespace edgewise
