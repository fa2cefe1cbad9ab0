#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Slice theorem: the spectrum along a line through the origin of the image's spectrum is that of
/// the image's integrals along the lines across it. The spectrum is read by a Kaiser-Bessel window,
/// times the transform of the bilinear field, as far as that is above `cut`; what repeats with the
/// offsets is folded, as sampling has it; and transformed back. Angles along an axis are followed
/// as radon.backward does: there the transform fades least.
///
/// Edge    object/scalar -> hough/scalar, see radon_edge()
/// Needs   a sinogram; samples that are finite: a transform would spread the others over all lines
/// Work    a transform of the image, padded to twice its width and height; for each angle some
///         0.6 offsets / cut^(1/4) places in the spectrum, 36 complex taps each
/// Error   ghosts of the window and rounding of its table, 3.5e-5 of the largest value; what is
///         beyond the cut, as for white noise of half the largest value; rounding of transforms
/// Source  Bracewell 1956; Jackson et al. 1991; [W93] FIGURE 10 and 12
Transition radon_fourier();

}  // namespace edgewise
