#include "transitions/spectrum/moments.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/load_values.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/spectrum.hpp"
#include "transitions/spectrum/depth_polynomial.hpp"
#include "transitions/spectrum/forward.hpp"
#include "transitions/spectrum/projection.hpp"

namespace edgewise {
namespace {

/// Beyond, light is gone in a fraction of the volume that no cubic follows.
constexpr double kSteepest = 100;
constexpr double kPowers = 8;  // operations a voxel: its value, three factors

Parameters forward_parameters(const Parameters& with) {
    return {{"width", with.number("width")}, {"padding", with.number("padding")}};
}

Request without_cue(const Request& want) {
    Request plain = want;
    plain.cue.reset();
    return plain;
}

kernels::SpectrumShape moment_shape(const Offer& offer) {
    return {offer.from.extent,
            {static_cast<int>(offer.with.number("width")), offer.with.number("padding")}};
}

Offer moments_offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_faded_projection(ask); !reason.empty())
        return Offer::no(std::move(reason));
    const DepthCue& cue = *ask.want.cue;
    const double number = with.number("degree");
    const int degree = static_cast<int>(number);
    if (number != degree) return Offer::no(fmt::format("a degree of {} is no whole one", number));
    if (cue.linear && degree > 1)
        return Offer::no("light that falls off linearly needs no moments beyond the first");
    const double width = with.number("width"), padding = with.number("padding");
    const std::vector<kernels::KaiserBessel> known = moment_windows();
    if (std::none_of(known.begin(), known.end(), [&](const kernels::KaiserBessel& window) {
            return window.width() == width && window.padding() == padding;
        }))
        return Offer::no(fmt::format(
            "no window of width {} for padding {}: moments take 4 and 6, with 1.25, 1.5 and 2",
            width, padding));
    const Request plain = without_cue(ask.want);
    Offer offer = spectrum_forward().offer(from, {plain, ask.scene}, forward_parameters(with));
    if (!offer.refused.empty()) return offer;
    offer.with = with;
    offer.to.content = "moments";
    offer.to.facets.insert(degree_facet(degree));
    offer.to.extent.z *= static_cast<std::int64_t>(moments_up_to(degree).size());
    return offer;
}

Work moments_work(const Offer& offer, const Ask& ask, int view) {
    const Request plain = without_cue(ask.want);
    const double count =
        static_cast<double>(moments_up_to(static_cast<int>(offer.with.number("degree"))).size());
    Offer one = offer;
    one.with = forward_parameters(offer.with);
    one.to.extent = moment_shape(offer).stored();
    Work work = spectrum_forward().work(one, {plain, ask.scene}, view);
    const double voxels = static_cast<double>(offer.from.samples());
    // The samples times their powers are written, and read in place of the samples.
    work.operations = count * (work.operations + kPowers * voxels);
    work.streamed = count * (work.streamed + 8 * voxels);
    work.workspace += 4 * voxels;
    return work;
}

/// The coordinate of each voxel along an axis to a power [half periods].
std::vector<double> powers_along(const kernels::SpectrumShape& shape, int axis, int power) {
    std::vector<double> powers(static_cast<std::size_t>(shape.volume[axis]));
    const double half = static_cast<double>(shape.period[axis]) / 2;
    for (std::size_t i = 0; i < powers.size(); ++i)
        powers[i] = std::pow((static_cast<double>(i) -
                              static_cast<double>(shape.origin()[static_cast<std::size_t>(axis)])) /
                                 half,
                             power);
    return powers;
}

/// The samples, less what is subtracted, times a moment.
void multiply(const Data& in, double subtract, const kernels::SpectrumShape& shape,
              const Moment& moment, float* out, Context& context) {
    const Extent& n = in.what.extent;
    const kernels::Grid volume = kernels::grid_of(in);
    std::array<std::vector<double>, 3> factors;
    for (int axis = 0; axis < 3; ++axis)
        factors[static_cast<std::size_t>(axis)] =
            powers_along(shape, axis, moment.power[static_cast<std::size_t>(axis)]);
    tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t z) {
        if (context.stopped()) return;
        kernels::Block<double> row(static_cast<std::size_t>(n.x), context.memory);
        for (std::int64_t y = 0; y < n.y; ++y) {
            const std::int64_t first = (z * n.y + y) * n.x;
            kernels::load_values(volume, first, n.x, subtract, row.data());
            const double of_row =
                factors[1][static_cast<std::size_t>(y)] * factors[2][static_cast<std::size_t>(z)];
            for (std::int64_t x = 0; x < n.x; ++x)
                out[first + x] = static_cast<float>(row[static_cast<std::size_t>(x)] * of_row *
                                                    factors[0][static_cast<std::size_t>(x)]);
        }
    });
    context.poll();
}

void moments_run(const Offer& offer, const Ask&, const Data& in, Data& out, const Region&,
                 Context& context) {
    const kernels::SpectrumShape shape = moment_shape(offer);
    const int degree = static_cast<int>(offer.with.number("degree"));
    kernels::Block<float> product(static_cast<std::size_t>(in.what.samples()), context.memory);
    auto* spectrum = out.as<kernels::Complex>();
    for (const Moment& moment : moments_up_to(degree)) {
        multiply(in, offer.to.values.offset, shape, moment, product.data(), context);
        const kernels::Grid grid{product.data(), Type::f32, in.what.extent, 1, {}};
        kernels::spectrum_of_volume(grid, 0, shape, spectrum, context.memory,
                                    [&] { return context.stopped(); });
        context.poll();
        spectrum += shape.stored().samples();
    }
    out.facets[window_facet(shape.window)] = shape.window;
    out.facets[degree_facet(degree)] = degree;
}

}  // namespace

std::string no_faded_projection(const Ask& ask) {
    const Request& want = ask.want;
    if (!want.cue) return "light does not fall off along rays: one spectrum has it all";
    const Request plain = without_cue(want);
    if (std::string reason = no_projection({plain, ask.scene}); !reason.empty()) return reason;
    if (!want.mode->takes_cue) return fmt::format("{} takes no depth cue", name_of(want.mode));
    const double fall = want.cue->per_length * deepest(want);
    if (want.cue->linear && fall > 1)
        return fmt::format(
            "light ends at a depth of {:.4g}, and the volume is {:.4g} deep: there it is no "
            "polynomial",
            1 / want.cue->per_length, deepest(want));
    if (!want.cue->linear && fall > kSteepest)
        return fmt::format(
            "light falls by exp(-{:.4g}) within the volume: no polynomial of degree {} follows it",
            fall, DepthPolynomial::kMostDegree);
    return {};
}

std::vector<kernels::KaiserBessel> moment_windows() {
    std::vector<kernels::KaiserBessel> all;
    for (const kernels::KaiserBessel& window : windows())
        if ((window.width() == 4 || window.width() == 6) && window.padding() >= kTriedPadding)
            all.push_back(window);
    return all;
}

std::string degree_facet(int degree) { return fmt::format("degree{}", degree); }

int degree_of(const Representation& moments) {
    for (int degree = 1; degree <= DepthPolynomial::kMostDegree; ++degree)
        if (moments.facets.contains(degree_facet(degree))) return degree;
    throw RunError("moments do not say of which degree they are");
}

Extent one_spectrum(const Representation& moments) {
    Extent one = moments.extent;
    one.z /= static_cast<std::int64_t>(moments_up_to(degree_of(moments)).size());
    return one;
}

std::vector<std::string> moment_kinds() {
    std::vector<std::string> kinds;
    for (int degree = 1; degree <= DepthPolynomial::kMostDegree; ++degree)
        for (const kernels::KaiserBessel& window : moment_windows())
            kinds.push_back("object/moments+" + degree_facet(degree) + "+" + window_facet(window));
    return kinds;
}

Transition spectrum_moments() {
    Transition edge;
    edge.name = "spectrum.moments";
    edge.source = "Totsuka, Levoy 1993; counts of FFTW's manual";
    for (const std::string& kind : moment_kinds()) edge.joins.emplace_back("object/scalar", kind);
    edge.parameters = {
        {"degree", number(1, DepthPolynomial::kMostDegree, {1, 2, 3},
                          "of the polynomial that light follows with depth")},
        {"width", number(4, 6, {4, 6}, "taps of the window along each axis: 4 or 6")},
        {"padding", number(1.25, 2, {kTriedPadding}, "period over extent: 1.25, 1.5 or 2")}};
    edge.on_demand = true;  // its error is measured by making pictures
    edge.offer = moments_offer;
    edge.work = moments_work;
    edge.run = moments_run;
    return edge;
}

}  // namespace edgewise
