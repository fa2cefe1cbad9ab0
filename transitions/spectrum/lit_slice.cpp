#include "transitions/spectrum/lit_slice.hpp"

#include <vector>

#include "transitions/spectrum/gradients.hpp"

namespace edgewise {
namespace {

/// What each spectrum counts for in a view.
std::vector<SliceWeight> weights_of(const Representation& gradients, const Request& want,
                                    int view) {
    const int degree = gradient_spectra().degree_of(gradients);
    const Shading& shading = want.shading;
    const LightHarmonics by(shading.by, degree);
    const Eigen::Matrix3d to_screen = gradients_to_screen(gradients, want, view);
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
    std::vector<SliceWeight> weights(static_cast<std::size_t>(gradient_spectra().count(degree)));
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

}  // namespace

Transition spectrum_lit_slice() {
    Transition edge = slice_of_several(gradient_spectra(), "lit", no_lit_projection, weights_of);
    edge.name = "spectrum.lit_slice";
    edge.source = "Levoy 1992; Totsuka, Levoy 1993; Malzbender 1993";
    return edge;
}

}  // namespace edgewise
