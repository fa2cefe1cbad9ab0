#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Running sums of a box: what enters is added, what leaves is subtracted, axis by axis. The work
/// does not depend on the size of the box.
///
/// Edge    object/scalar -> object/filtered, see filtering_edge()
/// Needs   equal weights at all places of a box; samples that are finite
/// Work    two operations an axis, in f64, of rows and slices also around tiles
/// Error   that of filtering_edge(): sums are kept in f64, so that they do not drift
/// Source  McDonnell, "Box-filtering techniques", CGIP 17, 1981
Transition filter_running();

}  // namespace edgewise
