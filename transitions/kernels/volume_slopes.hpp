#pragma once

#include <memory_resource>

#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/stop.hpp"

namespace edgewise::kernels {

/// How a field between samples is derived at the samples.
enum class SlopesOf {
    spline,       // the derivative of the cubic B-spline through the samples, mirrored at the ends
    differences,  // half the difference of both neighbours; the outermost samples continue
};

/// The derivative of a field along one axis, at the samples [value per voxel].
///
/// At a sample the B-splines of both other axes reproduce the samples, so that the derivative is
/// that of the spline along one line: half the difference of neighbouring coefficients.
/// @param volume  any real type, one channel, whole
/// @param subtract  from all values first, so that detail on a large offset is not rounded away
/// @param out     as many samples as `volume` has, x fastest
/// @param stop    true: returns soon, with `out` unfinished
/// Bytes do not depend on the number of threads.
void volume_slopes(const Grid& volume, int axis, SlopesOf by, double subtract, float* out,
                   std::pmr::memory_resource* memory, const Stop& stop);

}  // namespace edgewise::kernels
