#include "transitions/spectrum/slice.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <optional>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/spectrum_slice.hpp"
#include "transitions/spectrum/projection.hpp"

namespace edgewise {
namespace {

kernels::Between between(Field field) {
    if (field == Field::linear) return kernels::Between::linear;
    return field == Field::spline ? kernels::Between::spline : kernels::Between::band;
}

kernels::SliceView view_of(const Offer& offer, const Ask& ask, int view) {
    const Extent& slice = offer.to.extent;
    const double width = static_cast<double>(2 * (slice.x - 1));
    return {.to_screen = kernels::affine_of(residual(offer.from, ask.want, view)),
            .width = 2 * (slice.x - 1),
            .height = slice.y,
            .between = between(ask.want.field),
            .folded = offer.with.word("band") == "volume",
            .scale = ask.want.unit / (width * static_cast<double>(slice.y))};
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_projection(ask); !reason.empty())
        return Offer::no(std::move(reason));
    const Extent period = picture_period_of(ask.want);
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.space = "slice";
    offer.to.facets.clear();
    offer.to.axes = 2;
    offer.to.extent = {period.x / 2 + 1, period.y, 1};
    offer.to.placed = ask.want.views;
    return offer;
}

Work work(const Offer& offer, const Ask& ask, int view) {
    const kernels::SliceView slice = view_of(offer, ask, view);
    const double samples = kernels::slice_samples(slice);
    const double width = window_of(offer.from).width();
    return {// Taps along x are pairs of f32; the sums along y and z come first, those along x last.
            .operations = samples * (4 * width * (width * width + width + 1) + 12 * width + 60),
            .streamed = 2 * offer.to.bytes(),
            .gathers = samples * width * width,
            .scratch = kernels::slice_scratch(slice),
            .workspace = kernels::slice_workspace(
                slice, kernels::SpectrumShape::period_of(offer.from.extent))};
}

// Errors of an X-ray over the range of the picture, measured as those of spectrum.forward; the mean
// takes the larger ones, for the sake of short rays.
constexpr double kInside = 1e-3, kInsideMean = 2e-3;
// What a mean's short rays make of it: four times the step, the most that was measured on a CT and
// an MR head, an engine and phantoms.
constexpr double kShortRays = 4;
// The trilinear field has more beyond the cutoff than the spline.
constexpr double kTrilinear = 2;
// What sampling at pixel centres folds into the picture: 3e-3 with pixels as large as voxels, 4e-3
// and 1.2e-2 with two and four times as large.
constexpr double kFolded = 3e-3, kFoldedMean = 6e-3, kFoldedGrowth = 1.3;

// A guess, for a formula without a preview.
constexpr double kFormula = 0.01;

/// Voxels along an axis that a ray passes while it is inside the box by the other two.
double drift(const Vec3& ray, const Extent& box, int axis) {
    double length = std::numeric_limits<double>::infinity();
    for (int other = 0; other < 3; ++other)
        if (other != axis)
            length = std::min(
                length, static_cast<double>(box[other]) / std::max(std::abs(ray[other]), 1e-12));
    return std::abs(ray[axis]) * length;
}

/// Mean square error [value^2] of what the volume's end does to one view.
///
/// At a face that the rays run along the picture drops by J, the integral along the face, within no
/// distance at all; the slice makes of this a step without the frequencies above half a sample.
/// What it lacks, and as much again folded in by sampling, is J^2 / 5 over a line one voxel wide
/// (twice the integral of 1 / (2 pi f)^2 over |f| > 1/2), of the n voxels that the picture is wide.
/// Rays that leave a face by s voxels make a ramp of the step, and 1 / (1 + 14.6 s^2) of that. A
/// mean divides ramps by the length of their rays, which near the edges of the box is next to
/// nothing.
double faces_of_view(const Ask& ask, int view) {
    const Request& want = ask.want;
    const Mat4& map = want.views.at(view);
    const Vec3 ray = map.topLeftCorner<3, 3>().inverse().col(2);
    Eigen::Index principal = 0;
    ray.cwiseAbs().maxCoeff(&principal);
    std::array<double, 3> step{};
    double ramps = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double away = drift(ray, want.input, axis);
        step[axis] = 1 / (1 + 14.6 * away * away);
        if (axis != principal) ramps = std::max(ramps, 1 - step[axis]);
    }
    if (want.mode != Mode::mean) ramps = 0;
    double sum = 0;
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2;
        const double jump = ask.scene.fact(fmt::format("face/{}", face)).value_or(0);
        sum += 0.2 * jump * jump * (step[axis] + kShortRays * kShortRays * ramps) /
               static_cast<double>(want.input[axis]);
    }
    return sum;
}

/// RMS error of all views for the faces of the volume [value]; of many views every few.
double faces_of(const Ask& ask) {
    constexpr int kLookedAt = 32;
    const int views = ask.want.views.different(), looked_at = std::min(views, kLookedAt);
    double sum = 0;
    for (int i = 0; i < looked_at; ++i)
        sum += faces_of_view(ask, ask.want.views.first_view(i * views / looked_at));
    return std::sqrt(sum / looked_at);
}

/// The largest distance of pixels, in the smallest spacing of the input.
double pixel_size(const Request& want) {
    double largest = 0;
    for (int variant = 0; variant < want.views.different(); ++variant) {
        const Mat4& view = want.views.at(want.views.first_view(variant));
        for (int row = 0; row < 2; ++row) {
            const Vec3 along = view.block<1, 3>(row, 0).transpose();
            largest = std::max(largest, 1 / along.cwiseQuotient(want.spacing).norm());
        }
    }
    return largest / want.spacing.minCoeff();
}

Error error(const Offer& offer, const Ask& ask) {
    const bool mean = ask.want.mode == Mode::mean;
    double bias = mean ? kInsideMean : kInside;
    if (ask.want.field == Field::linear) bias *= kTrilinear;
    if (offer.with.word("band") == "picture")
        bias += (mean ? kFoldedMean : kFolded) *
                std::pow(std::max(1., pixel_size(ask.want)), kFoldedGrowth);
    bias *= ask.scene.range;
    bias += faces_of(ask);
    // A formula need not be what its samples say; cubic samples of the preview tell how far it is.
    if (ask.want.field == Field::formula)
        bias += ask.scene.fact("picture/bspline3/0.25").value_or(kFormula * ask.scene.range);
    return {.bias = bias};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region&,
         Context& context) {
    kernels::slice_of_spectrum(
        in.as<kernels::Complex>(), kernels::SpectrumShape::period_of(in.what.extent),
        window_of(in.what), view_of(offer, ask, context.view), out.as<kernels::Complex>(),
        context.memory, [&] { return context.stopped(); });
    context.poll();
}

}  // namespace

Transition spectrum_slice() {
    Transition edge;
    edge.name = "spectrum.slice";
    edge.source = "Bracewell 1956; Malzbender 1993; Wittenbrink 1993, 5.1";
    for (const kernels::KaiserBessel& window : windows())
        edge.joins.emplace_back(spectrum_kind(window), "slice/spectrum");
    edge.parameters = {
        {"band", one_of({"volume", "picture"},
                        "frequencies: all of the volume's, or only the picture's own")}};
    edge.laws = {Law::linear};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
