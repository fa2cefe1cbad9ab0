#include "transitions/spectrum/moment_slice.hpp"

#include <algorithm>
#include <cmath>
#include <tbb/parallel_for.h>

#include "transitions/kernels/grid_of.hpp"
#include "transitions/kernels/pmr_block.hpp"
#include "transitions/kernels/spectrum_slice.hpp"
#include "transitions/spectrum/depth_polynomial.hpp"
#include "transitions/spectrum/moments.hpp"
#include "transitions/spectrum/projection.hpp"
#include "transitions/spectrum/slice.hpp"
#include "transitions/spectrum/slice_view.hpp"

namespace edgewise {
namespace {

/// A moment that counts for less than this share of full light is left out.
constexpr double kCounts = 1e-9;

/// What each spectrum counts for in a view; 0: nothing.
std::vector<double> weights_of(const Offer& offer, const Request& want, int view) {
    const int degree = degree_of(offer.from);
    const double depth = depth_of(want, view);
    const DepthPolynomial light(*want.cue, depth, degree);
    const Mat4 map = residual(offer.from, want, view);
    const Extent period = kernels::SpectrumShape::period_of(one_spectrum(offer.from));
    const double scale = 2 * want.unit / depth;
    DepthAxis axis{scale * (map(2, 3) - nearest_corner(want, view)) - 1, {}};
    for (int k = 0; k < 3; ++k)
        axis.along[static_cast<std::size_t>(k)] =
            scale * map(2, k) * static_cast<double>(period[k]) / 2;
    std::vector<double> weights = moment_weights(light, axis, degree);
    for (double& weight : weights)
        if (std::abs(weight) < kCounts) weight = 0;
    return weights;
}

Offer moment_slice_offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_faded_projection(ask); !reason.empty())
        return Offer::no(std::move(reason));
    const Extent period = picture_period_of(ask.want);
    Offer offer{.from = from, .to = from, .with = with};
    offer.to.space = "slice";
    offer.to.content = "faded";
    offer.to.drop_facets();
    offer.to.axes = 2;
    offer.to.extent = {period.x / 2 + 1, period.y, 1};
    offer.to.placed = ask.want.views;
    return offer;
}

/// The same step through one of the spectra, as spectrum.slice has it.
Offer through_one(const Offer& offer) {
    Offer one = offer;
    one.from.extent = one_spectrum(offer.from);
    return one;
}

Work moment_slice_work(const Offer& offer, const Ask& ask, int view) {
    double counting = 0;
    for (const double weight : weights_of(offer, ask.want, view)) counting += weight != 0;
    Work work = spectrum_slice().work(through_one(offer), ask, view);
    const double samples = static_cast<double>(offer.to.samples());
    work.operations = counting * (work.operations + 2 * samples);
    work.streamed = counting * (work.streamed + 2 * offer.to.bytes());
    work.gathers *= counting;
    work.lines.count *= counting;
    work.workspace += offer.to.bytes();
    return work;
}

Error moment_slice_error(const Offer& offer, const Ask& ask) {
    return spectrum_slice().error(offer, ask);
}

void moment_slice_run(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                      const Region& region, Context& context) {
    using kernels::Complex;
    const Extent one = one_spectrum(in.what), slice = out.what.extent;
    const kernels::SliceView view = slice_view(residual(offer.from, ask.want, context.view), slice,
                                               ask.want, offer.with.word("band"));
    const std::vector<double> weights = weights_of(offer, ask.want, context.view);
    kernels::Block<Complex> more(static_cast<std::size_t>(slice.samples()), context.memory);
    auto* sum = out.as<Complex>();
    std::fill_n(sum, slice.samples(), Complex{});
    for (std::size_t moment = 0; moment < weights.size(); ++moment) {
        if (weights[moment] == 0) continue;
        kernels::Grid spectrum = kernels::grid_of(in);
        spectrum.samples = in.as<Complex>() + static_cast<std::int64_t>(moment) * one.samples();
        spectrum.extent = one;
        kernels::SliceView weighed = view;
        weighed.scale *= weights[moment];
        kernels::slice_of_spectrum(spectrum, kernels::SpectrumShape::period_of(one),
                                   window_of(in.what), weighed, more.data(), out.held(), region,
                                   context.memory, [&] { return context.stopped(); });
        context.poll();
        tbb::parallel_for(std::int64_t{0}, slice.y, [&](std::int64_t y) {
            for (std::int64_t i = y * slice.x; i < (y + 1) * slice.x; ++i)
                sum[i] += more[static_cast<std::size_t>(i)];
        });
    }
}

}  // namespace

Transition spectrum_moment_slice() {
    Transition edge;
    edge.name = "spectrum.moment_slice";
    edge.source = "Totsuka, Levoy 1993; Malzbender 1993";
    for (const std::string& kind : moment_kinds()) edge.joins.emplace_back(kind, "slice/faded");
    edge.parameters = spectrum_slice().parameters;
    edge.offer = moment_slice_offer;
    edge.work = moment_slice_work;
    edge.error = moment_slice_error;
    edge.run = moment_slice_run;
    return edge;
}

}  // namespace edgewise
