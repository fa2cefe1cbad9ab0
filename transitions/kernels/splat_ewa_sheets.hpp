#pragma once

#include <cstdint>

#include "transitions/kernels/splat_ewa.hpp"
#include "transitions/kernels/splat_ordered.hpp"

namespace edgewise::kernels {

/// A splat by elliptical Gaussians of voxels that are classified first.
struct EwaSheets {
    EwaSplat splat;  // its volume and spans are not read
    ClassifiedRows rows;
};

/// Adds the voxels of a slice to a sheet: optical depths, as integrals over depth on the screen,
/// then these times red, green, blue, `plane` floats apart. In the order of memory. Voxels behind
/// the eye add nothing. Single-threaded.
/// @param sheet  rows have kEwaRoom floats more than pixels, and so has the last one
void add_to_ewa_sheet(const EwaSheets& of, std::int64_t slice, const SplatSums& sheet,
                      std::ptrdiff_t plane);

}  // namespace edgewise::kernels
