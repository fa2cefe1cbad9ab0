#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Ray casting that leaps: bricks of 4^3 samples know how many bricks away the nearest one lies
/// that may matter, and a ray passes by all that lie between at once.
///
/// Of a composite those bricks matter in which a value has an opacity; of a MIP those that hold
/// more than the least sample. A brick that matters to some rays is still left out for a ray that
/// has seen as much.
/// Edge    object/scalar -> screen/picture; only by --via
/// Shape   [nz, ny, nx], x fastest, any real type; one f32 a pixel, four of composite
/// Needs   mip, minip, or composite without light; one memory
/// Work    the bricks of project.ray_cast, and a byte a brick, in two sweeps over all of them
/// Error   that of project.ray_cast with a first-order hold: the same bytes
/// Source  Cohen and Sheffer, "Proximity clouds", The Visual Computer 11(1), 1994; Zuiderveld,
///         Koning, Viergever, "Acceleration of ray-casting using 3D distance transforms", 1992
Transition distance_cast();

}  // namespace edgewise
