#include "transitions/spectrum/forward.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <iterator>
#include <limits>
#include <optional>
#include <vector>

#include "graph/picture_facts.hpp"
#include "transitions/filters/field_filter.hpp"
#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/spectrum.hpp"
#include "transitions/spectrum/pixel_of_sum.hpp"
#include "transitions/spectrum/projection.hpp"
#include "transitions/spectrum/spectrum_model.hpp"
#include "transitions/trials/trials.hpp"

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

// Of these windows the errors are 0.18 to 0.51 of the mean ghost.
constexpr double kOfMeanGhost = 0.5;
/// Rounding of f32 where a window does not amplify it, over the range of the picture.
constexpr double kRounding = 2e-7;

double ghosts_of(const kernels::KaiserBessel& window) {
    const double rounding = kRounding * std::pow(std::max(1., window.amplified()), 3);
    for (const Ghosts& ghosts : kGhosts)
        if (ghosts.width == window.width() && ghosts.padding == window.padding())
            return ghosts.error;
    return kOfMeanGhost * window.mean_ghost() + rounding;
}

kernels::KaiserBessel window_of(const Parameters& with) {
    return {static_cast<int>(with.number("width")), with.number("padding")};
}

// The same of the errors that pictures by all windows share.
constexpr double kInside = 1e-3, kInsideMean = 2e-3;
// The trilinear field has more beyond the cutoff than the spline.
constexpr double kTrilinear = 2;
// A guess, for a formula.
constexpr double kFormula = 0.01;

/// Most that pixels differ by, as sums along rays have it: of an X-ray or mean the range of the
/// reference. Of other functions of the sum what the longest ray of the highest value has above one
/// of the lowest, where the function is steepest: rays with little to see err most, however small
/// the picture's range is.
double range_of_sums(const Ask& ask) {
    const Request& want = ask.want;
    if (want.mode->divides || grows_with_length(want)) return ask.scene.range;
    return (ask.scene.high - ask.scene.low) * steepness(want, ask.scene.low, ask.scene.high) *
           longest_ray(want) / want.unit;
}

/// Error by all windows, where no preview tells [value].
double inside_of(const Ask& ask) {
    double error = ask.want.mode->divides ? kInsideMean : kInside;
    if (ask.want.field == Field::linear) error *= kTrilinear;
    if (ask.want.field == Field::formula) error += kFormula;
    return error * range_of_sums(ask);
}

/// Why no spectrum is made of this; empty: one is.
std::string no_spectrum(const Representation& from, const Ask& ask) {
    if (std::string reason = no_projection(ask); !reason.empty()) return reason;
    if (from.axes != 3 || from.channels != 1 || from.layout != Layout::linear ||
        from.place != Place::memory || from.placed.one_a_view())
        return "a spectrum is made of a volume of one channel, whole in memory";
    return {};
}

Offer spectrum_by(const kernels::KaiserBessel& window, const Representation& from, const Ask& ask,
                  const Parameters& with) {
    const kernels::SpectrumShape shape(from.extent, window);
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

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    const double width = with.number("width"), padding = with.number("padding");
    if (width != std::floor(width) ||
        !kernels::KaiserBessel::known(static_cast<int>(width), padding))
        return Offer::no(
            fmt::format("no window of width {} for padding {}: widths are 2 to 8, "
                        "paddings 1.25, 1.5 and 2, and 1 for width 2",
                        width, padding));
    if (std::string reason = no_spectrum(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    return spectrum_by(window_of(with), from, ask, with);
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

/// What all windows get wrong [value of the picture].
double ends_of(const Ask& ask) { return ask.scene.fact(kSpectrumEnds).value_or(inside_of(ask)); }

/// What a window's ghosts and what all windows get wrong add up to.
/// @param ghosts  over the range of the picture
double with_ghosts(double ghosts, const Ask& ask) {
    return ends_of(ask) + ghosts * range_of_sums(ask) * (ask.want.mode->divides ? kShortRays : 1);
}

/// From here on errors count in values of the picture, to which what came before adds up.
Error error_by(double bias, const Ask& ask) {
    const Request& want = ask.want;
    const double samples = std::cbrt(static_cast<double>(want.input.samples()));
    double length = want.mode->divides ? 1 : samples * want.unit;
    if (!want.mode->divides && !grows_with_length(want))
        length = samples * steepness(want, ask.scene.low, ask.scene.high);
    return {.gain = ask.scene.fact(kBlurGain).value_or(length),
            .noise_gain = ask.scene.fact(kNoiseGain(field_filter(Field::nearest).name))
                              .value_or(length / std::sqrt(samples)),
            .bias = bias};
}

Error error(const Offer& offer, const Ask& ask) {
    const kernels::KaiserBessel window = window_of(offer.with);
    // What every window gets wrong is counted here too, as one number with this one's ghosts.
    return error_by(
        measured_error(window, offer.from, ask).value_or(with_ghosts(ghosts_of(window), ask)), ask);
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

// ---- windows for small errors ----------------------------------------------------------------

constexpr double kWidths[] = {6, 7, 8}, kPaddings[] = {1.5, 2};

/// What ghosts along all axes add up to at most, over the longest ray; and rounding.
double bound_of(const kernels::KaiserBessel& window) {
    return 3 * window.bound() + kRounding * std::pow(std::max(1., window.amplified()), 3);
}

/// Operations of a spectrum and of all its slices.
double operations_by(const kernels::KaiserBessel& window, const Extent& extent, const Ask& ask) {
    const double taps = std::pow(window.width(), 3);
    // About so many samples has a plane through the frequencies up to 3/4 of a cycle.
    const double plane = 1.5 * 1.5 * std::pow(static_cast<double>(extent.samples()), 2. / 3);
    return kernels::spectrum_operations(kernels::SpectrumShape(extent, window)) +
           4 * taps * plane * ask.want.views.different();
}

/// Which window keeps an error for the least work; nothing where none does.
/// @param room  for its ghosts, over the range
std::optional<kernels::KaiserBessel> window_within(double room, const Extent& extent,
                                                   const Ask& ask) {
    std::optional<kernels::KaiserBessel> best;
    double least = std::numeric_limits<double>::infinity();
    for (const double width : kWidths)
        for (const double padding : kPaddings) {
            const kernels::KaiserBessel window(static_cast<int>(width), padding);
            const double taken = operations_by(window, extent, ask);
            if (bound_of(window) > room || taken >= least) continue;
            least = taken;
            best = window;
        }
    return best;
}

Offer offer_wide(const Representation& from, const Ask& ask, const Parameters& with) {
    if (!ask.want.budget.error || ask.want.budget.error_yields)
        return Offer::no(
            message("no error is asked for; spectrum.forward takes any width by @via"));
    if (std::string reason = no_spectrum(from, ask); !reason.empty())
        return Offer::no(std::move(reason));
    const double most = *ask.want.budget.error * ask.scene.range, ends = ends_of(ask);
    if (ends >= most)
        return Offer::no(
            fmt::format("pictures by any window are wrong by {:.2g}, which is asked "
                        "to be {:.2g}",
                        ends / ask.scene.range, *ask.want.budget.error));
    for (const kernels::KaiserBessel& window : SpectrumRays::tried())
        if (measured_error(window, from, ask).value_or(most) < most)
            return Offer::no(fmt::format("a window of {} taps keeps an error of {:.2g}",
                                         window.width(), *ask.want.budget.error));
    const double room =
        (most - ends) / (range_of_sums(ask) * (ask.want.mode->divides ? kShortRays : 1));
    const auto best = window_within(room, from.extent, ask);
    if (!best) return Offer::no(fmt::format("no window's bound is below {:.2g}", room));
    const kernels::KaiserBessel window = window_of(with);
    if (window.width() != best->width() || window.padding() != best->padding())
        return Offer::no(fmt::format("a window of {} taps and padding {} keeps the error for less",
                                     best->width(), best->padding()));
    return spectrum_by(window, from, ask, with);
}

Error error_wide(const Offer& offer, const Ask& ask) {
    return error_by(with_ghosts(bound_of(window_of(offer.with)), ask), ask);
}

}  // namespace

Transition spectrum_forward() {
    Transition edge;
    edge.name = "spectrum.forward";
    edge.source = "Malzbender 1993; counts of FFTW's manual";
    for (const kernels::KaiserBessel& window : windows())
        edge.joins.emplace_back("object/scalar", spectrum_kind(window));
    edge.parameters = {
        {"width", number(kernels::KaiserBessel::kNarrowest, kernels::KaiserBessel::kWidest, {4, 6},
                         "taps of the window along each axis: 2 to 8")},
        {"padding", number(1, 2, {kTriedPadding},
                           "period over extent: 1.25, 1.5 or 2; of width 2 also 1, linear")}};
    edge.laws = {Law::linear};
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.model = spectrum_model;
    edge.run = run;
    edge.trials = [] {
        std::vector<Trial> all = picture_trials(Combine::sum);
        join(all, picture_trials(Combine::mean));
        return all;
    };
    edge.factors = {{"", 1.8}};
    return edge;
}

Transition spectrum_wide() {
    Transition edge = spectrum_forward();
    edge.name = "spectrum.wide";
    edge.trials = {};
    edge.factors.clear();
    edge.joins.clear();
    std::vector<double> paddings(std::begin(kPaddings), std::end(kPaddings));
    std::vector<double> widths(std::begin(kWidths), std::end(kWidths));
    for (const double width : widths)
        for (const double padding : paddings)
            edge.joins.emplace_back("object/scalar", spectrum_kind(kernels::KaiserBessel(
                                                         static_cast<int>(width), padding)));
    edge.parameters = {
        {"width", number(widths.front(), widths.back(), widths, "taps of the window: 6 to 8")},
        {"padding",
         number(paddings.front(), paddings.back(), paddings, "period over extent: 1.5 or 2")}};
    edge.laws = {};  // of requests without a budget, which it is never on the path of
    edge.offer = offer_wide;
    edge.error = error_wide;
    edge.model = {};  // that of spectrum.forward measures what all windows get wrong
    return edge;
}

}  // namespace edgewise
