#include "transitions/spectrum/forward.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <fmt/format.h>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/spectrum.hpp"
#include "transitions/spectrum/projection.hpp"
#include "transitions/spectrum/spectrum_model.hpp"

namespace edgewise {
namespace {

/// Error of an X-ray by the window's ghosts, over the range of the picture.
struct Ghosts {
    int width;
    double padding, error;
};
// Measured on six scanned volumes (CT and MR of heads, tooth, engine, vessels) in six views
// against the spline reference, the largest of them; a test compares prediction and measurement.
constexpr Ghosts kGhosts[] = {{4, 1.25, 1.4e-3}, {6, 1.25, 9e-5}, {4, 1.5, 4e-4},
                              {6, 1.5, 6e-6},    {4, 2, 2e-4},    {6, 2, 2e-6}};
// For the mean: rays that meet little of the volume divide their ghosts by a short length.
constexpr double kShortRays = 12;

double ghosts_of(const kernels::KaiserBessel& window) {
    for (const Ghosts& ghosts : kGhosts)
        if (ghosts.width == window.width() && ghosts.padding == window.padding())
            return ghosts.error;
    return 1;
}

kernels::KaiserBessel window_of(const Parameters& with) {
    return {static_cast<int>(with.number("width")), with.number("padding")};
}

// The same of what pictures by all windows get wrong.
constexpr double kInside = 1e-3, kInsideMean = 2e-3;
// The trilinear field has more beyond the cutoff than the spline.
constexpr double kTrilinear = 2;
// A guess, for a formula.
constexpr double kFormula = 0.01;

/// Error by all windows, where no preview tells [value].
double inside_of(const Ask& ask) {
    double error = ask.want.mode->divides ? kInsideMean : kInside;
    if (ask.want.field == Field::linear) error *= kTrilinear;
    if (ask.want.field == Field::formula) error += kFormula;
    return error * ask.scene.range;
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_projection(ask); !reason.empty())
        return Offer::no(std::move(reason));
    const double width = with.number("width"), padding = with.number("padding");
    if (width != std::floor(width) ||
        !kernels::KaiserBessel::known(static_cast<int>(width), padding))
        return Offer::no(fmt::format(
            "no window of width {} for padding {}: widths are 4 and 6, paddings 1.25, 1.5 and 2",
            width, padding));
    if (from.axes != 3 || from.channels != 1 || from.layout != Layout::linear ||
        from.place != Place::memory || from.placed.one_a_view())
        return Offer::no("a spectrum is made of a volume of one channel, whole in memory");

    const kernels::SpectrumShape shape(from.extent, window_of(with));
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.content = "spectrum";
    offer.to.facets = {window_facet(shape.window)};
    offer.to.extent = shape.stored();
    offer.to.type = Type::c64;
    offer.to.values = {1, std::isfinite(ask.scene.commonest) ? ask.scene.commonest : 0};
    // Phases count from the origin voxel.
    const auto origin = shape.origin();
    Mat4 shift = Mat4::Identity();
    for (int axis = 0; axis < 3; ++axis) shift(axis, 3) = -static_cast<double>(origin[axis]);
    offer.to.placed = Placement(shift * from.placed.at(0).matrix());
    return offer;
}

Work work(const Offer& offer, const Ask&, int /*view*/) {
    const kernels::SpectrumShape shape(offer.from.extent, window_of(offer.with));
    const double in = offer.from.bytes(), out = offer.to.bytes();
    const double columns =
        static_cast<double>(shape.volume.z) / static_cast<double>(shape.period.z);
    const double rows = static_cast<double>(shape.volume.y) / static_cast<double>(shape.period.y);
    return {.operations = kernels::spectrum_operations(shape),
            // Rows are written, columns read and written; the lines along z read and write all.
            .streamed = in + out * columns * (2 * rows + 1) + out * (1 + columns),
            .scratch = kernels::spectrum_scratch(shape),
            .workspace = 16. * 1024};
}

Error error(const Offer& offer, const Ask& ask) {
    // From here on errors count in values of the picture, to which what came before adds up.
    const Request& want = ask.want;
    const double length =
        want.mode->divides ? 1 : std::cbrt(static_cast<double>(want.input.samples())) * want.unit;
    const double samples = std::cbrt(static_cast<double>(want.input.samples()));
    const kernels::KaiserBessel window = window_of(offer.with);
    const double ghosts =
        ghosts_of(window) * ask.scene.range * (want.mode->divides ? kShortRays : 1);
    // What every window gets wrong is counted here too, as one number with this one's ghosts.
    const double ends = ask.scene.fact("picture/spectrum/ends").value_or(inside_of(ask));
    const double measured = measured_error(window, offer.from, ask).value_or(ends + ghosts);
    return {.gain = ask.scene.fact("gain/blur").value_or(length),
            .noise_gain = ask.scene.fact("gain/noise/zoh").value_or(length / std::sqrt(samples)),
            .bias = measured};
}

void run(const Offer& offer, const Ask&, const Data& in, Data& out, const Region&,
         Context& context) {
    const kernels::SpectrumShape shape(in.what.extent, window_of(offer.with));
    kernels::spectrum_of_volume(kernels::grid_of(in), offer.to.values.offset, shape,
                                out.as<kernels::Complex>(), context.memory,
                                [&] { return context.stopped(); });
    context.poll();
    out.facets[window_facet(shape.window)] = shape.window;
}

}  // namespace

Transition spectrum_forward() {
    Transition edge;
    edge.name = "spectrum.forward";
    edge.source = "Malzbender 1993; counts of FFTW's manual";
    for (const kernels::KaiserBessel& window : windows())
        edge.joins.emplace_back("object/scalar", spectrum_kind(window));
    edge.parameters = {
        {"width", number(4, 6, {4, 6}, "taps of the window along each axis: 4 or 6")},
        {"padding", number(1.25, 2, {kTriedPadding}, "period over extent: 1.25, 1.5 or 2")}};
    edge.laws = {Law::linear};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.model = spectrum_model;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
