#pragma once

#include "graph/fact.hpp"

namespace edgewise {

// Facts that edges of several families read, and who measures them. A fact that one family alone
// reads is declared in the header of who measures it.

/// The error of samples, by what reads or moves them ("foh"): models of warps.
inline constexpr FactFamily kFieldError{"field"};
/// The same of samples on the way to a picture, as far as the picture shows it: what combines them.
inline constexpr FactFamily kCombinedError{"combined"};
/// The error of a picture over that of its samples (kCombinedError): likewise.
inline constexpr Fact kBlurGain{"gain/blur"};
/// The error of a picture that is cast, by filter and step: the model of casts, as all below.
inline constexpr FactFamily kPictureError{"picture"};
/// The error of a picture over independent noise of its samples, by filter.
inline constexpr FactFamily kNoiseGain{"gain/noise"};
/// Of modes that end rays early: the root of the share of rays that do.
inline constexpr Fact kEnded{"picture/ended"};

/// Samples a pixel at a step of 1 with the nearest hold: inside the data; taken without bricks;
/// taken with bricks. As those below counted by measure_casting().
inline constexpr Fact kCastAll{"cast/all"}, kCastTaken{"cast/taken"}, kCastBricks{"cast/bricks"};
/// Of composite, as shares, where a packet of rays needs one: of all samples (kCastAll) those whose
/// opacity a step that is not its unit corrects; the same of samples at the ends of rays, whatever
/// the step.
inline constexpr Fact kCastCorrected{"cast/corrected"}, kCastCorrectedEnds{"cast/corrected/ends"};

}  // namespace edgewise
