#include "transitions/kernels/ray_light.hpp"

#include <cmath>

namespace edgewise::kernels {

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
                   .facets = shading.by == Shade::torrance_sparrow,
                   .inverse_square = static_cast<float>(1 / (slope * slope))};
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
