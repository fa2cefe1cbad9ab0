#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// The slice of a view through spectra of gradients, each weighed as the view's lights have it: the
/// spectrum of the integral of samples that light falls on.
///
/// Edge    object/gradients+degree...+window... -> slice/lit, one a view
/// Shape   [py, px / 2 + 1] c64, as spectrum.slice
/// Work    that of spectrum.slice and two operations a sample, for each spectrum that counts
/// Error   that of spectrum.slice
/// Source  Levoy 1992; Totsuka, Levoy 1993
Transition spectrum_lit_slice();

}  // namespace edgewise
