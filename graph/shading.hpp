#pragma once

#include <vector>

#include "graph/transform.hpp"

namespace edgewise {

/// How light meets a sample.
enum class Shade { none, phong, torrance_sparrow };

/// A white light, infinitely far away.
struct Light {
    Vec3 towards{0, 0, -1};  // unit length, in screen space: z away from the eye
    double intensity = 1;
};

/// What becomes of light at a surface ([W93] EQ 51): shares that are sent back whatever the
/// direction, evenly from lit sides, and as from a mirror.
struct Material {
    double ambient = 0.1, diffuse = 0.7, specular = 0.2;
    double exponent = 10;  // of the mirror: the larger, the smaller its highlight
};

/// What light does at one sample: `diffuse` times the sample's colour and `specular` times white
/// go to the eye.
struct Lit {
    double diffuse = 1, specular = 0;
};

/// Lights and what they fall on.
struct Shading {
    Shade by = Shade::none;
    std::vector<Light> lights{{}};
    Material material = {};
    /// A gradient that is shorter [value per unit along screen z] tells of no surface. Its share of
    /// this length is the share of the material's diffuse and specular light that is left, so a
    /// homogeneous sample has its ambient light alone.
    double least = 0;

    bool on() const noexcept { return by != Shade::none; }
    /// @param gradient  of the value, in screen space, steps along all axes equally long; a side
    ///                  that faces away from the eye is turned round, so its sign does not matter
    /// @param to_eye    unit length
    Lit at(const Vec3& gradient, const Vec3& to_eye) const noexcept;
};

/// Beckmann's root mean square slope of facets whose highlight is as wide as that of an exponent.
double facet_slope(double exponent) noexcept;

}  // namespace edgewise
