#pragma once

#include <array>
#include <string>

#include "graph/transition.hpp"
#include "transitions/spectrum/several_spectra.hpp"

namespace edgewise {

/// Spectra of a volume and of lengths of its gradient, made once for all views: the sum of samples
/// that light falls on from a direction is in every view a sum of slices of these.
///
/// A sample counts a f + d sum I |g| w(N.L), g = grad f and N = -g / |g| (Shading::of_sums). With
/// w(c) = e0 + c / 2 + e2 c^2 that is a f, and of each light d I times e0 |g| - g.L / 2 + e2
/// (g.L)^2 / |g|. The first part of it and the last are sums of g_i g_j / |g|, or where e2 = 0 of
/// |g| alone. The middle one is a derivative, which is a factor in the spectrum of f.
///
/// Edge    object/scalar -> object/gradients+degree...+window..., 3D; c64, one spectrum behind the
///         other along z: f and |g| of degree 1; f and g_i g_j / |g| for xx, yy, zz, xy, xz, yz of
///         degree 2
/// Shape   [nz, ny, nx] -> [count pz, py, px / 2 + 12], p as spectrum.forward has it
/// Needs   X-ray or mean with --shade hemisphere or lambert, without depth cue; views that differ
///         by rotations and shifts alone, so that lengths of gradients are the same in all of them;
///         otherwise what spectrum.forward needs
/// Values  as spectrum.forward; gradients per voxel, their lengths per step along screen z
/// Work    that of spectrum.forward for each spectrum; three derivatives along lines
/// Error   measured by running the path: |g| is no smooth function where g vanishes, and what a
///         face of the volume cuts while it is bright has no derivative across it
/// Source  Levoy, Graphics Interface 1992; Totsuka, Levoy, SIGGRAPH 1993; harmonics of the cosine:
///         Ramamoorthi, Hanrahan, "An efficient representation for irradiance environment maps",
///         SIGGRAPH 2001
Transition spectrum_gradients();

/// How a rule of light hangs on the cosine c between normal and light: w(c) = even0 + c / 2 + even2
/// c^2. That of lambert, max(0, c), is replaced by its spherical harmonics up to a degree.
struct LightHarmonics {
    double even0 = 0.5, even2 = 0;
    double largest = 0;  // difference from the rule, of all cosines

    LightHarmonics(Shade by, int degree) noexcept;
};

/// Why a request's pictures are no sums of slices of these spectra; empty where they are.
std::string no_lit_projection(const Ask& ask);

/// A gradient by index of `from` -> in screen space of a view, where all steps are as long.
Eigen::Matrix3d gradients_to_screen(const Representation& from, const Request& want, int view);

/// Those of both degrees: two, or seven.
const SeveralSpectra& gradient_spectra();
/// The axes i and j of the spectra behind the first, of degree 2.
inline constexpr std::array<std::array<int, 2>, 6> kAxesOfProducts{
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};

}  // namespace edgewise
