#include "transitions/spectrum/slice.hpp"

#include <algorithm>
#include <cmath>
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
// The trilinear field has more beyond the cutoff than the spline.
constexpr double kTrilinear = 2;
// A volume that goes on to its faces ends there at once: six faces.
constexpr double kFaces = 4e-3, kFacesMean = 1.2e-2;
// What sampling at pixel centres folds into the picture: 3e-3 with pixels as large as voxels, 4e-3
// and 1.2e-2 with two and four times as large.
constexpr double kFolded = 3e-3, kFoldedMean = 6e-3, kFoldedGrowth = 1.3;

// A guess, for a formula without a preview.
constexpr double kFormula = 0.01;

/// How many of the six faces the volume reaches with values that are not empty.
int faces_reached(const Ask& ask) {
    int faces = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if (ask.scene.occupied.empty()) return 0;
        faces += ask.scene.occupied.begin[axis] <= 0;
        faces += ask.scene.occupied.end[axis] >= ask.want.input[axis];
    }
    return faces;
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

/// How much more of an integral's error is left in a mean, which divides it by the length of the
/// ray: the RMS of the longest ray over each.
std::optional<double> shortness(const Ask& ask) {
    const std::optional<double> inverse = ask.scene.fact("rays/inverse_length");
    if (!inverse) return {};
    const Extent& n = ask.want.input;
    const Vec3 size =
        Vec3(static_cast<double>(n.x), static_cast<double>(n.y), static_cast<double>(n.z))
            .cwiseProduct(ask.want.spacing) /
        ask.want.unit;
    return std::max(1.0, *inverse * size.maxCoeff());
}

Error error(const Offer& offer, const Ask& ask) {
    const bool mean = ask.want.mode == Mode::mean;
    double bias = mean ? kInsideMean : kInside;
    if (ask.want.field == Field::linear) bias *= kTrilinear;
    const double short_rays = mean ? shortness(ask).value_or(kFacesMean / kFaces) : 1;
    bias += kFaces * short_rays * faces_reached(ask) / 6;
    if (offer.with.word("band") == "picture")
        bias += (mean ? kFoldedMean : kFolded) *
                std::pow(std::max(1., pixel_size(ask.want)), kFoldedGrowth);
    bias *= ask.scene.range;
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
