#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "graph/transform.hpp"

namespace edgewise {

/// How light meets a sample. The last two are of sums along rays, see Shading::of_sums.
enum class Shade { none, phong, torrance_sparrow, particles, hemisphere, lambert };

/// As the command has it: "torrance-sparrow".
std::string_view name_of(Shade by) noexcept;

/// How the gradient of a field is taken, for light and for opacities.
enum class GradientScheme {
    central,  // the field's own derivative, or central differences where it has none
    /// Sobel's operator at the distance of samples: central differences with weights of 1 2 1 along
    /// both other axes. Of the noise of single samples 3/8 are left, and detail of three samples is
    /// softened. Source: Sobel, Feldman 1968; in 3D Zucker, Hummel 1981.
    sobel,
};

/// As the command has it: "sobel".
std::string_view name_of(GradientScheme scheme) noexcept;

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
/// go to the eye. Of sums a sample's colour is its value, and `specular` is a value too.
struct Lit {
    double diffuse = 1, specular = 0;
    double opacity = 1;    // times the sample's own
    double gradient = -1;  // its length [value per file unit]; below 0: nobody knows
};

/// Light of a sample falls off with its distance from the plane through the volume's nearest
/// corner.
struct DepthCue {
    double per_length = 0;  // K [1/file unit]
    bool linear = false;    // max(0, 1 - K t), else exp(-K t)

    double left(double depth) const noexcept;
};

/// The shares of light that reach a sample through what lies on the way: of each light, and of
/// ambient light.
struct Arriving {
    static constexpr std::size_t kMostLights = 8;
    std::array<double, kMostLights> lights{1, 1, 1, 1, 1, 1, 1, 1};
    double ambient = 1;
};

/// Lights and what they fall on.
struct Shading {
    Shade by = Shade::none;
    std::vector<Light> lights{{}};
    Material material = {};
    /// Of particles: Henyey and Greenstein's g, the mean cosine of the angle that light is turned
    /// by; 0: they scatter alike in all directions.
    double phase = 0;
    bool shadows = false;  // samples take away light that goes to others
    double occlusion = 0;  // ambient light is taken away by what is as near as that [file unit]
    /// A gradient that is shorter [value per unit along screen z] tells of no surface. Its share of
    /// this length is the share of the material's diffuse and specular light that is left, so a
    /// homogeneous sample has its ambient light alone.
    double least = 0;

    bool on() const noexcept { return by != Shade::none; }
    /// Whether light depends on the gradient.
    bool has_normals() const noexcept { return on() && by != Shade::particles; }
    /// The cosine between normal and view below which a surface is seen edge on: there both of its
    /// sides are seen, in shares that run evenly from one to the other, so that rounding does not
    /// decide which one the light falls on. It is that of 0.9 degrees.
    static constexpr double kEdgeOn = 1.0 / 64;
    /// @param gradient  of the value, in screen space, steps along all axes equally long; its sign
    ///                  does not matter: the side that is seen is the one that faces the eye
    /// @param to_eye    unit length
    Lit at(const Vec3& gradient, const Vec3& to_eye, const Arriving& arriving = {}) const noexcept;
    /// Whether it is a rule of sums. A sample counts a f + d sum I |grad f| w(N.L), with f its
    /// value, a and d the shares of `material`, grad f per step along screen z, and N = -grad f /
    /// |grad f|, from high values to low ones. w is (1 + N.L) / 2 of hemisphere, max(0, N.L) of
    /// lambert. Nothing is turned to the eye, and `least` does not matter. Source: Levoy, "Volume
    /// rendering using the Fourier projection-slice theorem", Graphics Interface 1992; Totsuka,
    /// Levoy, "Frequency domain volume rendering", SIGGRAPH 1993
    bool of_sums() const noexcept { return by == Shade::hemisphere || by == Shade::lambert; }
    /// Whether some of the light does not arrive.
    bool has_shade() const noexcept { return shadows || occlusion > 0; }
};

/// Henyey and Greenstein's phase function times 4 pi, so that its mean over the sphere is 1.
/// @param cosine  of the angle that light is turned by
double phase_of(double g, double cosine) noexcept;

/// Beckmann's root mean square slope of facets whose highlight is as wide as that of an exponent.
double facet_slope(double exponent) noexcept;

}  // namespace edgewise
