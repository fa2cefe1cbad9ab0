#include "transitions/spectrum/moment_slice.hpp"

#include <cmath>
#include <vector>

#include "transitions/kernels/spectrum.hpp"
#include "transitions/spectrum/depth_polynomial.hpp"
#include "transitions/spectrum/moments.hpp"
#include "transitions/spectrum/slice.hpp"
#include "transitions/spectrum/weighed_slices.hpp"

namespace edgewise {
namespace {

/// A moment that counts for less than this share of full light is left out.
constexpr double kCounts = 1e-9;

/// What each spectrum counts for in a view.
std::vector<SliceWeight> weights_of(const Offer& offer, const Request& want, int view) {
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
    std::vector<SliceWeight> weights;
    for (const double weight : moment_weights(light, axis, degree))
        weights.push_back({.value = std::abs(weight) < kCounts ? 0 : weight});
    return weights;
}

Offer moment_slice_offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_faded_projection(ask); !reason.empty())
        return Offer::no(std::move(reason));
    return weighed_offer("faded", from, ask, with);
}

Work moment_slice_work(const Offer& offer, const Ask& ask, int view) {
    return weighed_work(one_spectrum(offer.from), weights_of(offer, ask.want, view), offer, ask,
                        view);
}

Error moment_slice_error(const Offer& offer, const Ask& ask) {
    return spectrum_slice().error(offer, ask);
}

void moment_slice_run(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                      const Region& region, Context& context) {
    weighed_slices(one_spectrum(in.what), weights_of(offer, ask.want, context.view), offer, ask, in,
                   out, region, context);
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
