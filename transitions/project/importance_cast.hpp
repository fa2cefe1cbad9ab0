#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Compositing by importance: the step along a ray grows as its transparency falls, so that samples
/// are taken where they are seen.
///
/// Light of a piece counts times the transparency T before it, and so does its error. Pieces of
/// length d that err by A d^2 lose the sum of A T d^2 in all. Of all ways to place as many samples
/// that sum is smallest where d is 1 / sqrt(T) times a constant. A sample therefore stands for
/// floor(sqrt(4 loss / T)) steps, at least one, where T was left before the sample before: behind T
/// = loss for two and more. So:
///  - with any data a picture differs from that of equal steps by at most `loss` in each channel
///    (of 0 to 1): that is all that is left to see where the first step grows;
///  - let opacity a be that of a depth s = -log(1 - a) a unit of length, of at most M, that changes
///    by at most S a unit along rays, and colours by at most C. Then a picture differs from the
///    exact one by at most (S / 4 + M C / 2) step^2 (n + 4 loss m) + kTerminated, of rays with n
///    samples that stand for one step and m that stand for more.
/// Edge    object/scalar (foh) or object/coefficients (bspline3) -> screen/picture
/// Shape   as project.ray_cast
/// Needs   a mode that composites, without light; one memory
/// Work    at most that of project.ray_cast with bricks, and 25 operations a sample, for each ray
///         goes by itself
/// Error   measured by runs; see above
/// Source  Danskin and Hanrahan, "Fast algorithms for volume ray tracing", 1992 Workshop on Volume
///         Visualization
Transition importance_cast();

}  // namespace edgewise
