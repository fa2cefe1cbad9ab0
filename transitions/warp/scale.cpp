#include "transitions/warp/scale.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "graph/spread.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/filters/read_by.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/scale.hpp"
#include "transitions/trials/trials.hpp"
#include "transitions/warp/equiareal.hpp"

namespace edgewise {
namespace {

const Filter& filter_of(const Parameters& with) { return filter_named(with.word("filter")); }

/// Places of equal spacing among the samples.
struct EqualGrid {
    std::array<double, 3> step{1, 1, 1};  // from place to place [sample]
    Extent extent;
    std::string refused = {};
};

Vec3 spacing_of(const Representation& from, const Request& want) {
    const Mat4 to_input = from.placed.at(0).inverse().matrix();
    return (want.spacing.asDiagonal() * to_input.topLeftCorner<3, 3>()).colwise().norm();
}

/// |det| of all views. @param refused  why there is no such number, or that none scales
double determinant_of(const Representation& from, const Request& want, std::string& refused) {
    constexpr double kSame = 1e-9;
    double first = 0;
    for (int variant = 0; variant < want.views.different(); ++variant) {
        const int view = want.views.first_view(variant);
        const double det = std::abs(residual(from, want, view).topLeftCorner<3, 3>().determinant());
        if (!(det > 1e-12) || !std::isfinite(det))
            refused = fmt::format("view {}: determinant {:.3g}, no inverse", view, det);
        else if (variant > 0 && std::abs(det / first - 1) > kSame)
            refused = fmt::format("views scale differently: by {:.6g} and {:.6g}", first, det);
        if (!refused.empty()) return det;
        if (variant == 0) first = det;
    }
    if (std::abs(first - 1) <= kSame) refused = "the views scale nothing: their determinant is 1";
    return first;
}

EqualGrid grid_for(const Representation& from, const Request& want) {
    constexpr double kSame = 1e-9;     // of spacings
    constexpr double kCoarser = 1e-6;  // files keep spacings as f32
    EqualGrid grid;
    const Vec3 spacing = spacing_of(from, want);
    if (spacing.maxCoeff() <= spacing.minCoeff() * (1 + kSame)) {
        grid.refused = "the samples are equally spaced: there is nothing to scale";
        return grid;
    }
    const double det = determinant_of(from, want, grid.refused);
    if (!grid.refused.empty()) return grid;
    const double equal = std::cbrt(spacing.prod() / det);
    if (equal > spacing.minCoeff() * (1 + kCoarser)) {
        grid.refused = fmt::format(
            "pixels ask for a grid of spacing {:.4g}, which would skip samples that lie {:.4g} "
            "apart",
            equal, spacing.minCoeff());
        return grid;
    }
    std::array<std::int64_t, 3> count{};
    for (int axis = 0; axis < 3; ++axis) {
        const double step = equal / spacing[axis];
        grid.step[axis] = std::abs(step - 1) <= kSame ? 1 : step;
        const double covered = static_cast<double>(from.extent[axis]) / grid.step[axis];
        if (covered > 1e6) {
            grid.refused = fmt::format("{:.3g} samples along an axis", covered);
            return grid;
        }
        // Rounding adds no place.
        count[axis] = std::max<std::int64_t>(1, std::llround(std::ceil(covered - 1e-9)));
    }
    grid.extent = {count[0], count[1], count[2]};
    return grid;
}

/// Index of `from` -> place of the grid.
Mat4 map_of(const EqualGrid& grid, const Extent& from) {
    Mat4 map = Mat4::Identity();
    for (int axis = 0; axis < 3; ++axis) {
        map(axis, axis) = 1 / grid.step[axis];
        map(axis, 3) = static_cast<double>(grid.extent[axis] - 1) / 2 -
                       static_cast<double>(from[axis] - 1) / 2 / grid.step[axis];
    }
    return map;
}

std::string refusal(const Representation& from, const Ask& ask, const Parameters& with) {
    if (!ask.want.job->of_rays())
        return "a grid ends beside the faces of the input, which only rays leave out";
    if (from.axes != 3) return "an image has no depth to look through";
    if (from.channels != 1) return fmt::format("{} channels; rays combine one", from.channels);
    if (from.type == Type::c64) return "complex samples have no hold";
    if (!is_whole(from)) return "needs all samples in memory, row by row";
    if (from.placed.one_a_view()) return "the samples lie in another place in each view";
    if (ask.want.eye) return "the eye is at a finite distance: no grid makes its rays equiareal";
    if (ask.want.projective()) return "a projective map is not equiareal on any grid";
    // What reads the grid combines whole slices, one by one.
    if (!ask.want.clips.empty()) return "the clip cuts slices, which are combined whole";
    if (ask.want.shading.on())
        return "light needs gradients across slices, which are combined one by one";
    if (ask.scene.non_finite > 0)
        return fmt::format("{} samples are not finite: each axis would spread them",
                           ask.scene.non_finite);
    return not_read_by(filter_of(with), {.coefficients = from.content == "coefficients",
                                         .labels = ask.want.field == Field::nearest});
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = refusal(from, ask, with); !reason.empty())
        return Offer::no(std::move(reason));
    EqualGrid grid = grid_for(from, ask.want);
    if (!grid.refused.empty()) return Offer::no(std::move(grid.refused));
    Representation to = from;
    to.space = kScaled;
    to.content = "scalar";
    to.drop_facets();
    to.extent = grid.extent;
    to.type = Type::f32;
    to.values = {};
    to.placed = Placement(Mat4(map_of(grid, from.extent) * from.placed.at(0).matrix()));
    return {.from = from, .to = std::move(to), .with = with};
}

std::array<kernels::ScaledAxis, 3> axes_of(const Offer& offer, const Request& want) {
    const EqualGrid grid = grid_for(offer.from, want);
    std::array<kernels::ScaledAxis, 3> axes;
    for (int axis = 0; axis < 3; ++axis)
        axes[axis] = kernels::scaled_axis(offer.from.extent[axis], grid.extent[axis],
                                          grid.step[axis], filter_of(offer.with));
    return axes;
}

Work work(const Offer& offer, const Ask& ask, int) {
    const auto [x, y, z] = axes_of(offer, ask.want);
    const auto n = [](std::int64_t count) { return static_cast<double>(count); };
    const Extent &from = offer.from.extent, &to = offer.to.extent;
    const double slices = n(to.z), taps[3] = {n(x.taps), n(y.taps), n(z.taps)};
    const double along_z = n(from.x) * n(from.y) * 2 * taps[2];
    const double along_y = n(from.x) * n(to.y) * 2 * taps[1];
    const double along_x = n(to.x) * n(to.y) * (2 * taps[0] + 2);  // and the value map
    const double weights = filter_of(offer.with).operations * (n(to.x) + n(to.y) + n(to.z));
    const double slice = offer.from.bytes() / n(from.z);
    return {.operations = slices * (along_z + along_y + along_x) + weights,
            .streamed = slices * taps[2] * slice + offer.to.bytes(),
            .scratch = (n(from.y) + 1) * n(from.x) * sizeof(float)};
}

Error error(const Offer& offer, const Ask& ask) {
    const Scene& scene = ask.scene;
    const Filter& filter = filter_of(offer.with);
    const EqualGrid grid = grid_for(offer.from, ask.want);
    const auto between = static_cast<double>(
        std::count_if(grid.step.begin(), grid.step.end(), [](double s) { return s != 1; }));
    // f32 rounds weights and the sums along three axes, of stored numbers.
    const double greatest =
        std::max(std::abs(scene.low), std::abs(scene.high)) + std::abs(offer.from.values.offset);
    Error error{.noise = 0x1p-22 * greatest};
    // Noise of neighbours on a finer grid is no longer independent: what reads between them takes
    // away less of it than it says, at worst nothing of 2/3 an axis.
    error.noise_gain = std::pow(std::max(1.0, filter.noise_gain) * std::sqrt(1.5), between);
    const bool is_the_field =
        ask.want.field != Field::formula && field_filter(ask.want.field).name == filter.name;
    if (!is_the_field) error.bias = hold_error(filter.name, ask);
    return error;
}

kernels::Scaling scaling_of(const Offer& offer, const Request& want, const kernels::Grid& volume) {
    return {volume, axes_of(offer, want)};
}

Partition parts(const Offer& offer, const Ask& ask) {
    constexpr std::int64_t kSlices = 8;
    return {.kind = Partition::output,
            .leaf = {offer.to.extent.x, offer.to.extent.y, kSlices},
            .reads = [offer, want = ask.want](const Region& out, int) {
                const kernels::Grid grid{.extent = offer.from.extent, .values = {}};
                return scaling_of(offer, want, grid).reads(out);
            }};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    const kernels::Scaling by = scaling_of(offer, ask.want, kernels::grid_of(in));
    const Extent held = out.held().extent();
    tbb::parallel_for(region.begin[2], region.end[2], [&](std::int64_t z) {
        if (context.stopped()) return;
        Region slice = region;
        slice.begin[2] = z;
        slice.end[2] = z + 1;
        kernels::Block<float> scratch(by.scratch_floats(slice), context.memory);
        by(slice, out.at<float>(region.begin[0], region.begin[1], z), held.x, held.x * held.y,
           scratch.data());
    });
    context.poll();
}

}  // namespace

Transition scaling() {
    Transition edge;
    edge.name = "warp.scale";
    edge.source = "Wittenbrink 1993, 3.7, FIGURE 36";
    edge.joins = {{"object/scalar", "scaled/scalar"}, {"object/coefficients", "scaled/scalar"}};
    edge.parameters = {{"filter", any_filter({"foh", "bspline3"})}};
    edge.laws = {Law::constant};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.parts = parts;
    edge.run = run;
    edge.trials = warp_trials;
    edge.factors = {{"", 2}};  // a guess: a plain loop
    return edge;
}

}  // namespace edgewise
