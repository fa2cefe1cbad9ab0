#include "transitions/kernels/ray_light.hpp"

#include <cmath>

namespace edgewise::kernels {

RayEdges ray_edges_of(const std::vector<Transfer::Edge>& edges, const Vec3& per_length,
                      const ValueMap& values) {
    RayEdges made{
        .per_length = {}, .first = static_cast<float>(edges.front().opacity), .ramps = {}};
    for (int axis = 0; axis < 3; ++axis)
        made.per_length[static_cast<std::size_t>(axis)] =
            static_cast<float>(values.slope * per_length[axis]);
    constexpr double kSteepest = 1e30;
    for (std::size_t i = 1; i < edges.size(); ++i) {
        const double width = edges[i].magnitude - edges[i - 1].magnitude;
        OpticsRamp ramp{.start = static_cast<float>(edges[i - 1].magnitude)};
        ramp.inverse_width = static_cast<float>(width > 1 / kSteepest ? 1 / width : kSteepest);
        ramp.opacity = static_cast<float>(edges[i].opacity - edges[i - 1].opacity);
        made.ramps.push_back(ramp);
    }
    return made;
}

RayLight ray_light_of(const Shading& shading, const Eigen::Matrix3d& to_screen,
                      const ValueMap& values) {
    const Material& material = shading.material;
    const double slope = facet_slope(material.exponent);
    RayLight light{.to_screen = {},
                   .sources = {},
                   .ambient = static_cast<float>(material.ambient),
                   .diffuse = static_cast<float>(material.diffuse),
                   .specular = static_cast<float>(material.specular),
                   .exponent = static_cast<float>(material.exponent),
                   .least = static_cast<float>(shading.least),
                   .by = shading.by,
                   .inverse_square = static_cast<float>(1 / (slope * slope)),
                   .phase = static_cast<float>(shading.phase),
                   .phase_least = static_cast<float>(std::pow(1 - std::abs(shading.phase), 2)),
                   .phase_share = static_cast<float>(1 - shading.phase * shading.phase)};
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            light.to_screen[static_cast<std::size_t>(3 * row + column)] =
                static_cast<float>(values.slope * to_screen(row, column));
    for (const Light& source : shading.lights)
        light.sources.push_back(
            {{static_cast<float>(source.towards.x()), static_cast<float>(source.towards.y()),
              static_cast<float>(source.towards.z())},
             static_cast<float>(source.intensity)});
    return light;
}

}  // namespace edgewise::kernels
