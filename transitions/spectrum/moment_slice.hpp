#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// The slice of a view through spectra of moments, each weighed as the view's depth has it: the
/// spectrum of the integral of samples whose light falls off.
///
/// Edge    object/moments+degree...+window... -> slice/faded, one a view
/// Shape   [py, px / 2 + 1] c64, as spectrum.slice
/// Work    that of spectrum.slice once a moment that counts, and two additions a sample; along an
///         axis of the volume only the powers of one coordinate count
/// Error   that of spectrum.slice
/// Source  Totsuka, Levoy 1993
Transition spectrum_moment_slice();

}  // namespace edgewise
