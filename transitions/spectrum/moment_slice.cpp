#include "transitions/spectrum/moment_slice.hpp"

#include <cmath>
#include <vector>

#include "transitions/kernels/spectrum.hpp"
#include "transitions/spectrum/depth_polynomial.hpp"
#include "transitions/spectrum/moments.hpp"

namespace edgewise {
namespace {

/// A moment that counts for less than this share of full light is left out.
constexpr double kCounts = 1e-9;

/// What each spectrum counts for in a view.
std::vector<SliceWeight> weights_of(const Representation& moments, const Request& want, int view) {
    const int degree = moment_spectra().degree_of(moments);
    const double depth = depth_of(want, view);
    const DepthPolynomial light(*want.cue, depth, degree);
    const Mat4 map = residual(moments, want, view);
    const Extent period = kernels::SpectrumShape::period_of(moment_spectra().one_of(moments));
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

}  // namespace

Transition spectrum_moment_slice() {
    Transition edge = slice_of_several(moment_spectra(), "faded", no_faded_projection, weights_of);
    edge.name = "spectrum.moment_slice";
    edge.source = "Totsuka, Levoy 1993; Malzbender 1993";
    return edge;
}

}  // namespace edgewise
