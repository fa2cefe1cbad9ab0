#include "transitions/spectrum/lit_slice.hpp"

#include <vector>

#include "transitions/spectrum/gradients.hpp"
#include "transitions/spectrum/moments.hpp"
#include "transitions/spectrum/projection.hpp"
#include "transitions/spectrum/slice.hpp"
#include "transitions/spectrum/weighed_slices.hpp"

namespace edgewise {
namespace {

/// What each spectrum counts for in a view.
std::vector<SliceWeight> weights_of(const Offer& offer, const Request& want, int view) {
    const int degree = degree_of(offer.from);
    const Shading& shading = want.shading;
    const LightHarmonics by(shading.by, degree);
    const Eigen::Matrix3d to_screen = gradients_to_screen(offer.from, want, view);
    double all = 0;                                     // intensities
    Vec3 towards = Vec3::Zero();                        // sum of I L, of a gradient by index
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();  // sum of I L L^T, likewise
    for (const Light& light : shading.lights) {
        const Vec3 along = to_screen.transpose() * light.towards;
        all += light.intensity;
        towards += light.intensity * along;
        squares += light.intensity * along * along.transpose();
    }
    const double share = shading.material.diffuse;
    std::vector<SliceWeight> weights(static_cast<std::size_t>(spectra_of_degree(degree)));
    weights[0].value = shading.material.ambient;
    for (std::size_t axis = 0; axis < 3; ++axis)
        weights[0].derivative[axis] = -share / 2 * towards[static_cast<int>(axis)];
    if (degree == 1) {
        weights[1].value = share * by.even0 * all;
        return weights;
    }
    const Eigen::Matrix3d counts =
        by.even0 * all * to_screen.transpose() * to_screen + by.even2 * squares;
    for (std::size_t k = 0; k < kAxesOfProducts.size(); ++k) {
        const auto [i, j] = kAxesOfProducts[k];
        weights[k + 1].value = share * (i == j ? 1 : 2) * counts(i, j);
    }
    return weights;
}

Offer offer(const Representation& from, const Ask& ask, const Parameters& with) {
    if (std::string reason = no_lit_projection(ask); !reason.empty())
        return Offer::no(std::move(reason));
    return weighed_offer("lit", from, ask, with);
}

Work work(const Offer& offer, const Ask& ask, int view) {
    return weighed_work(one_of_gradients(offer.from), weights_of(offer, ask.want, view), offer, ask,
                        view);
}

Error error(const Offer& offer, const Ask& ask) { return spectrum_slice().error(offer, ask); }

void run(const Offer& offer, const Ask& ask, const Data& in, Data& out, const Region& region,
         Context& context) {
    weighed_slices(one_of_gradients(in.what), weights_of(offer, ask.want, context.view), offer, ask,
                   in, out, region, context);
}

}  // namespace

Transition spectrum_lit_slice() {
    Transition edge;
    edge.name = "spectrum.lit_slice";
    edge.source = "Levoy 1992; Totsuka, Levoy 1993; Malzbender 1993";
    for (const std::string& kind : gradient_kinds()) edge.joins.emplace_back(kind, "slice/lit");
    edge.parameters = spectrum_slice().parameters;
    edge.offer = offer;
    edge.work = work;
    edge.error = error;
    edge.run = run;
    return edge;
}

}  // namespace edgewise
