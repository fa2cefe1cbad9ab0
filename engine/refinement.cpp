#include "engine/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace edgewise {

FrontBound front_bound_of(const Data& picture, double light) {
    const std::int64_t pixels = picture.what.samples();
    const float* opacity = picture.as<float>() + 3;
    FrontBound bound;
    for (std::int64_t i = 0; i < pixels; ++i) {
        const double through = light * std::clamp(1.0 - opacity[4 * i], 0.0, 1.0);
        bound.most = std::max(bound.most, through);
        bound.mean += through;
    }
    if (pixels > 0) bound.mean /= static_cast<double>(pixels);
    return bound;
}

double most_light_of(const Shading& shading) {
    const Material& m = shading.material;
    double least = 0, share = 1;  // whatever the lights, and of the light of each
    switch (shading.by) {
        case Shade::none:
            return 1;
        case Shade::phong:
            least = m.ambient;
            share = m.diffuse + m.specular;
            break;
        case Shade::torrance_sparrow:
            // A mirror of facets sends back at most what the others leave.
            least = m.ambient;
            share = std::max(m.diffuse, 1 - m.ambient);
            break;
        case Shade::particles:
            share = phase_of(std::abs(shading.phase), 1);
            break;
        case Shade::hemisphere:
        case Shade::lambert:
            return 1;  // of sums, which have no opacity that hides what is behind
    }
    double light = least;
    for (const Light& source : shading.lights) light += share * source.intensity;
    return std::max(light, 1.0);
}

Refinement::Refinement(bool writes, std::optional<double> stop_after)
    : writes_(writes), stop_after_(stop_after), taker_(std::make_shared<FrontWatch>()) {}

FrontWatch Refinement::watch() const {
    return [taker = taker_](const FrontPicture& front) { return !*taker || (*taker)(front); };
}

void Refinement::give_to(FrontWatch taker) { *taker_ = std::move(taker); }

}  // namespace edgewise
