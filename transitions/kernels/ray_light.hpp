#pragma once

#include <array>
#include <vector>

#include "graph/request.hpp"
#include "graph/samples.hpp"
#include "graph/shading.hpp"
#include "graph/small_objects.hpp"
#include "transitions/kernels/optics.hpp"

namespace edgewise::kernels {

/// How light falls off along rays: at t the depth is near + cosine t, of which the share of light
/// is left that DepthCue says.
struct RayCue {
    DepthCue by;
    double near = 0;  // depth of t = 0 [t]
    double unit = 1;  // one t, in the file's unit
};

/// Opacities by the length of the gradient, Transfer::edges in f32.
struct RayEdges {
    std::array<float, 3> per_length;  // of a gradient of stored numbers by input index
    float first = 1;                  // below the first ramp
    SmallVector<OpticsRamp> ramps;
};

/// What rays need to light their samples: a Shading in f32.
struct RayLight {
    struct Source {
        std::array<float, 3> towards;
        float intensity;
    };
    /// Row by row: a gradient of stored numbers by input index -> of values in screen space, where
    /// steps along all axes are equally long.
    std::array<float, 9> to_screen;
    SmallVector<Source> sources;
    float ambient, diffuse, specular, exponent, least;
    Shade by;                        // any but none
    float inverse_square;            // of facet_slope(exponent)
    float phase;                     // Henyey and Greenstein's g, of particles
    float phase_least, phase_share;  // (1 - |g|)^2 and 1 - g^2
};

/// @param per_length  samples in a file unit, along each axis
RayEdges ray_edges_of(const std::vector<Transfer::Edge>& edges, const Vec3& per_length,
                      const ValueMap& values);
/// @param to_screen  a gradient of values by input index -> in screen space
RayLight ray_light_of(const Shading& shading, const Eigen::Matrix3d& to_screen,
                      const ValueMap& values);

}  // namespace edgewise::kernels
