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

Request without_cue(const Request& want) {
    Request plain = want;
    plain.cue.reset();
    return plain;
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
    return moment_spectra().offer(from, {without_cue(ask.want), ask.scene}, with);
}

Work moments_work(const Offer& offer, const Ask& ask, int view) {
    const Request plain = without_cue(ask.want);
    Work work = moment_spectra().work(offer, {plain, ask.scene}, view);
    const double voxels = static_cast<double>(offer.from.samples()),
                 count = moment_spectra().count(static_cast<int>(offer.with.number("degree")));
    // The samples times their powers are written, and read in place of the samples.
    work.operations += count * kPowers * voxels;
    work.streamed += count * 8 * voxels;
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
    const kernels::SpectrumShape shape = SeveralSpectra::shape_of(offer);
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
    SeveralSpectra::name_facets(offer, out);
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

const SeveralSpectra& moment_spectra() {
    static constexpr SeveralSpectra spectra{
        .content = "moments", .most_degree = DepthPolynomial::kMostDegree, .count = [](int degree) {
            return static_cast<int>(moments_up_to(degree).size());
        }};
    return spectra;
}

Transition spectrum_moments() {
    Transition edge;
    edge.name = "spectrum.moments";
    edge.source = "Totsuka, Levoy 1993; counts of FFTW's manual";
    for (const std::string& kind : moment_spectra().kinds())
        edge.joins.emplace_back("object/scalar", kind);
    edge.parameters =
        moment_spectra().parameters("of the polynomial that light follows with depth");
    edge.on_demand = true;  // its error is measured by making pictures
    edge.offer = moments_offer;
    edge.work = moments_work;
    edge.run = moments_run;
    return edge;
}

}  // namespace edgewise
