#pragma once

#include <array>
#include <vector>

#include "graph/samples.hpp"
#include "graph/shading.hpp"

namespace edgewise::kernels {

/// What rays need to light their samples: a Shading in f32.
struct RayLight {
    struct Source {
        std::array<float, 3> towards;
        float intensity;
    };
    /// Row by row: a gradient of stored numbers by input index -> of values in screen space, where
    /// steps along all axes are equally long.
    std::array<float, 9> to_screen;
    std::vector<Source> sources;
    float ambient, diffuse, specular, exponent, least;
    bool facets;           // Torrance-Sparrow's, else Phong's mirror
    float inverse_square;  // of facet_slope(exponent)
};

/// @param to_screen  a gradient of values by input index -> in screen space
RayLight ray_light_of(const Shading& shading, const Eigen::Matrix3d& to_screen,
                      const ValueMap& values);

}  // namespace edgewise::kernels
