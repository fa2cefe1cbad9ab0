#pragma once

#include <memory_resource>

#include "transitions/kernels/fourier.hpp"
#include "transitions/kernels/grid.hpp"
#include "transitions/kernels/kaiser_bessel.hpp"
#include "transitions/kernels/stop.hpp"

namespace edgewise::kernels {

/// How the spectrum of a volume is stored: F(k / period) of the volume around its origin voxel,
/// half of it (kx >= 0), with some columns repeated on both sides so that a window never wraps
/// along x.
///
/// Frames: object space [voxel]; origin = voxel extent / 2 rounded down; frequencies f in cycles
/// per voxel, F(f) = sum over voxels of value exp(-2 pi i f . (voxel - origin)).
struct SpectrumShape {
    static constexpr std::int64_t kColumnsBefore = 4, kColumnsAfter = 7;

    Extent volume;
    Extent period;  // of the padded volume [voxel]; x even
    KaiserBessel window;

    /// Periods of at least padding x extent with small prime factors.
    SpectrumShape(const Extent& volume, const KaiserBessel& window);
    /// Complex samples: {period.x / 2 + 1 and the repeated columns, period.y, period.z}.
    Extent stored() const noexcept { return stored_of(period); }
    static Extent stored_of(const Extent& period) noexcept;
    /// The inverse of stored_of.
    static Extent period_of(const Extent& stored) noexcept;
    std::array<std::int64_t, 3> origin() const noexcept {
        return {volume.x / 2, volume.y / 2, volume.z / 2};
    }
};

/// The spectrum of (value - subtract), divided beforehand by the window's transform.
///
/// @param volume  one channel, finite values
/// @param out     shape.stored() complex samples
/// @param memory  scratch: spectrum_scratch(shape) bytes a thread
/// @param stop    true: returns soon, with `out` unfinished
/// Bytes do not depend on the number of threads: every line is transformed by one thread.
/// Source: Malzbender, ACM Trans. Graphics 12(3), 1993; [W93] 5.1
void spectrum_of_volume(const Grid& volume, double subtract, const SpectrumShape& shape,
                        Complex* out, std::pmr::memory_resource* memory, const Stop& stop);

/// Bytes of scratch for each thread.
double spectrum_scratch(const SpectrumShape& shape) noexcept;
/// Operations of spectrum_of_volume: the rows, columns and planes that are not zero, and the
/// weights.
double spectrum_operations(const SpectrumShape& shape) noexcept;

}  // namespace edgewise::kernels
