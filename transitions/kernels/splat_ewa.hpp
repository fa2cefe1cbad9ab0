#pragma once

#include <array>
#include <cstdint>

#include "transitions/kernels/splat.hpp"

namespace edgewise::kernels {

// Splatting by elliptical Gaussians: the kernel of a voxel is a Gaussian of one width along all
// axes of index space. Its integral along the rays of a view is a Gaussian on the screen too, as
// long as rays near the voxel are parallel. This Gaussian is the footprint, for each voxel
// by itself.
//
// Frames used below:
//   index space  [voxel]  of the volume; centres at integers
//   screen       [pixel]  origin at the centre of the top-left pixel; depth [t] counts from the eye

/// A volume and how it is seen. Parallel rays: the depth is 1 everywhere, `plane` is 1, the eye 0.
struct EwaSplat {
    /// Footprints end so many standard deviations from their middle; what is cut off is given to
    /// the rest.
    static constexpr double kRadius = 4;

    Grid volume;                                // one channel, any real type
    float empty = 0;                            // the stored number that adds nothing
    const SplatSpan* spans = nullptr;           // of each row: y, then z
    std::array<PlaceOnScreen, 2> screen;        // of a centre, as parallel rays would show it
    PlaceOnScreen depth{1, {}};                 // of a centre, from the eye
    std::array<double, 2> eye{};                // where it is on the screen [pixel]
    double plane = 1;                           // depth of the plane that pixels lie in
    std::array<double, 2> least{}, greatest{};  // slopes of the picture's outer rays [pixel / t]
    double variance = 0;                        // of kernels, along each axis [voxel^2]
    double low_pass = 0;                        // added to that of footprints [pixel^2]
    double mass = 1;                            // of a voxel's kernel [pixel^2 t]
};

/// Adds the footprints of slices [begin, end) along z to the sums, each times the sample less
/// `empty`: integrals over depth. In the order of memory, so that a sum does not depend on which
/// pixels go with it. Samples that are not finite, and those behind the eye, add nothing.
/// Single-threaded.
/// @param sums  rows have kEwaRoom floats more than pixels, and so has the last one
/// @param row   scratch for as many samples as the volume has along x
void splat_ewa(const EwaSplat& splat, std::int64_t begin, std::int64_t end, const SplatSums& sums,
               Splatted* row);

inline constexpr std::int64_t kEwaRoom = 16;  // vectors reach so far beyond a footprint

}  // namespace edgewise::kernels
