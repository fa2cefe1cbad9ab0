#include "transitions/spectrum/slice.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/spectrum_slice.hpp"
#include "transitions/spectrum/projection.hpp"
#include "transitions/trials/trials.hpp"

namespace edgewise {
namespace {

kernels::Between between(Field field) {
    if (field == Field::linear) return kernels::Between::linear;
    return field == Field::spline ? kernels::Between::spline : kernels::Between::band;
}

kernels::SliceView view_of(const Offer& offer, const Request& want, int view) {
    const Extent& slice = offer.to.extent;
    const double width = static_cast<double>(2 * (slice.x - 1));
    return {.to_screen = kernels::affine_of(residual(offer.from, want, view)),
            .width = 2 * (slice.x - 1),
            .height = slice.y,
            .between = between(want.field),
            .folded = offer.with.word("band") == "volume",
            .scale = want.unit / (width * static_cast<double>(slice.y))};
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_projection(ask); !reason.empty())
        return Offer::no(std::move(reason));
    const Extent period = picture_period_of(ask.want);
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.space = "slice";
    offer.to.content = "spectrum";  // also of a Hartley transform
    offer.to.type = Type::c64;
    offer.to.drop_facets();
    offer.to.axes = 2;
    offer.to.extent = {period.x / 2 + 1, period.y, 1};
    offer.to.placed = ask.want.views;
    return offer;
}

/// Cache lines that one sample brings after the one before it. A step of d samples of the spectrum
/// brings into the window d_y w + d_z w rows of w samples, and the ends of w^2 rows by d_x. What
/// the row of samples before had read is near only where it did not go far: it is not counted.
double lines_of_sample(const Representation& spectrum, const kernels::SliceView& slice) {
    const Extent period = spectrum_period(spectrum);
    const double width = window_of(spectrum).width();
    const bool hartley = spectrum.content == kHartley;  // rows of f32, at f and at -f
    const double bytes = hartley ? sizeof(float) : sizeof(kernels::Complex);
    std::array<double, 3> step;
    for (int axis = 0; axis < 3; ++axis)
        step[axis] =
            std::min(1., std::abs(slice.to_screen[axis]) * static_cast<double>(period[axis]) /
                             static_cast<double>(slice.width));
    // A row may begin anywhere in a line.
    const double row = (width * bytes + kLineBytes - bytes) / kLineBytes;
    const double rows = std::min(width * width, width * (step[1] + step[2]));
    const double ends = (width * width - rows) * step[0] * bytes / kLineBytes;
    return (hartley ? 2 : 1) * (rows * row + ends);
}

Work work(const Offer& offer, const Ask& ask, int view) {
    const kernels::SliceView slice = view_of(offer, ask.want, view);
    const double samples = kernels::slice_samples(slice);
    const double width = window_of(offer.from).width();
    const bool hartley = offer.from.content == kHartley;
    return {// Taps along x are pairs of f32; the sums along y and z come first, those along x last.
            .operations = samples * (4 * width * (width * width + width + 1) + 12 * width + 60),
            .streamed = 2 * offer.to.bytes(),
            // A Hartley transform is read at f and at -f.
            .gathers = samples * width * width * (hartley ? 2 : 1),
            .lines = {.count = samples * lines_of_sample(offer.from, slice)},
            .scratch = kernels::slice_scratch(slice),
            .workspace = kernels::slice_workspace(slice, spectrum_period(offer.from))};
}

/// spectrum.forward knows the loss of the volume's band. The loss beyond the picture's band depends
/// on how edges fall between pixels: a face along the rays rings by up to a tenth of its jump, and
/// no fact of a preview predicts that.
Error error(const Offer& offer, const Ask&) {
    return offer.with.word("band") == "volume" ? Error{} : Error::unknown();
}

Partition parts(const Offer& offer, const Ask& ask) {
    // The two halves of a Hartley transform that a sample is made of are far from each other.
    if (offer.from.content == kHartley) return {.kind = Partition::output, .leaf = offer.to.extent};
    return {.kind = Partition::output,
            .leaf = offer.to.extent,
            .reads = [offer, want = ask.want](const Region& out, int view) {
                return kernels::spectrum_read(kernels::SpectrumShape::period_of(offer.from.extent),
                                              window_of(offer.from), view_of(offer, want, view),
                                              out);
            }};
}

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    kernels::slice_of_spectrum(kernels::grid_of(in), spectrum_period(in.what), window_of(in.what),
                               view_of(offer, ask.want, context.view), out.as<kernels::Complex>(),
                               out.held(), region, context.memory,
                               [&] { return context.stopped(); });
    context.poll();
}

}  // namespace

Transition spectrum_slice() {
    Transition edge;
    edge.name = "spectrum.slice";
    edge.source = "Bracewell 1956; Malzbender 1993; Wittenbrink 1993, 5.1";
    for (const kernels::KaiserBessel& window : windows())
        edge.joins.emplace_back(spectrum_kind(window), "slice/spectrum");
    for (const kernels::KaiserBessel& window : windows())
        edge.joins.emplace_back(hartley_kind(window), "slice/spectrum");
    edge.parameters = {
        {"band", one_of({"volume", "picture"},
                        "frequencies: all of the volume's, or only the picture's own")}};
    edge.laws = {Law::linear};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.parts = parts;
    edge.run = run;
    edge.trials = [] {
        std::vector<Trial> all = picture_trials(Combine::sum);
        join(all, picture_trials(Combine::mean));
        return all;
    };
    edge.factors = {{"", 0.86}, {"/band=picture", 1}};
    return edge;
}

}  // namespace edgewise
