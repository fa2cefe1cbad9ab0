#include "graph/shading.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace edgewise {
namespace {

/// EQ 51: the cosine between the mirrored light and the eye, to a power.
double mirrored(const Vec3& normal, const Vec3& light, const Vec3& eye, double exponent) {
    const double cosine = 2 * normal.dot(light) * normal.dot(eye) - light.dot(eye);
    return std::pow(std::max(0.0, cosine), exponent);
}

/// Torrance and Sparrow 1967, with Beckmann's distribution of facets (1 where they face both light
/// and eye), their shadows, and Schlick's reflectance, of which `specular` is that of light that
/// falls straight; over `specular`.
double from_facets(const Vec3& normal, const Vec3& light, const Vec3& eye, const Material& of) {
    const Vec3 half = (light + eye).normalized();
    const double nl = normal.dot(light), nv = std::abs(normal.dot(eye)), nh = normal.dot(half),
                 vh = eye.dot(half);
    if (!(nl > 0) || !(nv > 0) || !(nh > 0) || !(vh > 0)) return 0;
    const double slope = facet_slope(of.exponent), cosine = nh * nh;
    const double facets = std::exp((cosine - 1) / (cosine * slope * slope)) / (cosine * cosine);
    const double shadows = std::min({1.0, 2 * nh * nv / vh, 2 * nh * nl / vh});
    const double reflected = of.specular + (1 - of.specular) * std::pow(1 - vh, 5);
    // A grazing mirror would send more than falls on it.
    const double left = std::max(0.0, 1 - of.ambient - of.diffuse * nl);
    return std::min(left, reflected * facets * shadows / nv);
}

double share_of(const Arriving& arriving, std::size_t light) {
    return light < arriving.lights.size() ? arriving.lights[light] : 1;
}

/// Shading::of_sums: the value that light adds to a sample's.
double added_by(const Shading& shading, const Vec3& gradient) {
    const double length = gradient.norm();
    if (!std::isfinite(length)) return 0;
    double light = 0;
    for (const Light& source : shading.lights) {
        const double along = -gradient.dot(source.towards);  // |grad f| N.L
        light += source.intensity *
                 (shading.by == Shade::hemisphere ? (length + along) / 2 : std::max(0.0, along));
    }
    return shading.material.diffuse * light;
}

}  // namespace

std::string_view name_of(Shade by) noexcept {
    switch (by) {
        case Shade::none:
            return "none";
        case Shade::phong:
            return "phong";
        case Shade::torrance_sparrow:
            return "torrance-sparrow";
        case Shade::particles:
            return "particles";
        case Shade::hemisphere:
            return "hemisphere";
        case Shade::lambert:
            return "lambert";
    }
    return "?";
}

std::string_view name_of(GradientScheme scheme) noexcept {
    return scheme == GradientScheme::sobel ? "sobel" : "central";
}

double DepthCue::left(double depth) const noexcept {
    return linear ? std::max(0.0, 1 - per_length * depth) : std::exp(-per_length * depth);
}

double phase_of(double g, double cosine) noexcept {
    // 1 + g^2 - 2 g cos, in a form that does not cancel where g is near 1 or -1.
    const double size = std::abs(g), away = 1 - (g < 0 ? -cosine : cosine);
    return (1 - g * g) / std::pow((1 - size) * (1 - size) + 2 * size * away, 1.5);
}

double facet_slope(double exponent) noexcept { return std::sqrt(2 / (exponent + 2)); }

Lit Shading::at(const Vec3& gradient, const Vec3& to_eye, const Arriving& arriving) const noexcept {
    if (!on()) return {};
    if (by == Shade::particles) {
        Lit scattered{0, 0};
        for (std::size_t i = 0; i < lights.size(); ++i)
            scattered.diffuse += share_of(arriving, i) * lights[i].intensity *
                                 phase_of(phase, -lights[i].towards.dot(to_eye));
        return scattered;
    }
    if (of_sums()) return {material.ambient, added_by(*this, gradient)};
    const double length = gradient.norm();
    Lit lit{material.ambient * arriving.ambient, 0};
    if (!(length > 0) || !std::isfinite(length)) return lit;
    const Vec3 axis = gradient / length;
    const double surface = least > 0 ? std::min(1.0, length / least) : 1;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const Light& light = lights[i];
        // Of the side that the light falls on.
        const Vec3 normal = axis.dot(light.towards) < 0 ? Vec3(-axis) : axis;
        const double facing = normal.dot(light.towards);
        const double seen = std::clamp((1 + normal.dot(to_eye) / kEdgeOn) / 2, 0.0, 1.0);
        if (!(facing > 0) || !(seen > 0)) continue;
        const double strength = seen * surface * light.intensity * share_of(arriving, i);
        lit.diffuse += strength * material.diffuse * facing;
        lit.specular +=
            strength * (by == Shade::phong ? material.specular * mirrored(normal, light.towards,
                                                                          to_eye, material.exponent)
                                           : from_facets(normal, light.towards, to_eye, material));
    }
    return lit;
}

}  // namespace edgewise
