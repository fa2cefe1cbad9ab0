#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Precision: writes the samples as another type, with a value map that says what they mean.
/// Edge    object/scalar -> object/scalar; parameter type = u8 | i16 | u16 | f32
/// Steps   Integers that fit are kept as they are. Else the data's range is cut into as many steps
/// as
///         the type has, such that the commonest value is met exactly: rounded one way over half a
///         volume it would be no noise but an offset, which X-rays add up.
/// Refuses types that are no smaller (but f32 for 32-bit integers); values that are not finite, as
///         integers have none; labels, where steps would make new ones
/// Work    6 operations a sample: scale, shift, round, two bounds, convert
/// Error   noise of step / sqrt(12) [value], none where the samples are kept; f32 of f64 and 32-bit
///         integers: half a last place. Pixels of modes with a threshold jump as often as noise is
///         large, so their mean square goes with its first power: noise passes as the root of its
///         size and of that at which gains are measured (kMeasuredNoise)
Transition precision();

/// RMS of the error of rounding to 8 bits, over the data's range. The commonest value is kept
/// exactly: previews measure gains of noise with noise of this size.
constexpr double kMeasuredNoise = 1 / (254 * 3.4641016151377544);

}  // namespace edgewise
