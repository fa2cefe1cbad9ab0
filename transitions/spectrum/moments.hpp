#pragma once

#include <string>

#include "graph/transition.hpp"
#include "transitions/spectrum/several_spectra.hpp"

namespace edgewise {

/// Spectra of a volume times powers of its coordinates, made once for all views: the sum of samples
/// whose light falls off with depth is in every view a sum of slices of these.
///
/// Edge    object/scalar -> object/moments+degree...+window..., 3D; c64, one spectrum behind the
///         other along z: 4, 10 or 20 of degree 1, 2 or 3
/// Shape   [nz, ny, nx] -> [count pz, py, px / 2 + 12], p as spectrum.forward has it
/// Needs   X-ray or mean with a depth cue; a linear one that does not end inside the volume, of
///         degree 1; an exponential one that falls by at most exp(-100) in it; otherwise what
///         spectrum.forward needs
/// Values  as spectrum.forward; coordinates count from the origin voxel, in half periods
/// Work    that of spectrum.forward and 8 a voxel, once a moment
/// Error   measured by running the path. Of an exponential cue it is at most the bound of its
///         polynomial (DepthPolynomial) times what a ray adds up, beside what any slice gets wrong
/// Source  Totsuka, Levoy, "Frequency domain volume rendering", SIGGRAPH 1993, section 3
Transition spectrum_moments();

/// Why a request's pictures are no sums of slices of moments; empty where they are.
std::string no_faded_projection(const Ask& ask);

/// Those of all degrees: as many as moments_up_to(degree) has, in its order.
const SeveralSpectra& moment_spectra();

}  // namespace edgewise
