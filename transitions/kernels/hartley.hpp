#pragma once

#include "transitions/kernels/fourier.hpp"
#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/stop.hpp"

namespace edgewise::kernels {

/// How the Hartley transform of a volume is stored: real samples at all k of the period, with some
/// columns repeated on both sides so that a window never wraps along x.
struct HartleyShape {
    static constexpr std::int64_t kColumnsBefore = 4, kColumnsAfter = 5;

    static Extent stored_of(const Extent& period) noexcept {
        return {period.x + kColumnsBefore + kColumnsAfter, period.y, period.z};
    }
    static Extent period_of(const Extent& stored) noexcept {
        return {stored.x - kColumnsBefore - kColumnsAfter, stored.y, stored.z};
    }
};

/// H = Re F - Im F: the sum over voxels of value cas(2 pi f . (voxel - origin)), cas t = cos t +
/// sin t, of the whole phase. It is no product of transforms along the axes, whose planes through
/// the origin are no transforms of projections.
///
/// @param spectrum  of spectrum_of_volume, SpectrumShape::stored_of(period) complex samples
/// @param out       HartleyShape::stored_of(period) samples
/// @param stop      true: returns soon, with `out` unfinished
/// Bytes do not depend on the number of threads. Source: Bracewell 1986; [W93] EQ 79, 80
void hartley_of_spectrum(const Grid& spectrum, const Extent& period, float* out, const Stop& stop);

}  // namespace edgewise::kernels
