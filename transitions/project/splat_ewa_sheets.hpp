#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Composites by elliptical Gaussians, with an eye or without: voxels are classified first, and the
/// Gaussians of a slice are added up on a sheet, by optical depth. Sheets are composited from front
/// to back, pixel by pixel. Slices are those of the axis that the middle ray is steepest to; from
/// an eye between two of them both sides are visited outwards.
///
/// Kernels and ellipses are those of project.splat_ewa. Near faces one factor a ray, for all of its
/// sheets, makes up for what is missing there. Colours are blurred, for these are splatted in place
/// of values. The picture changes suddenly ("pops") where the middle ray's steepest axis changes.
/// Edge    object/scalar -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; four f32 a pixel
/// Needs   composite without light, finite samples, all in one memory; an eye, where there is one,
///         at least 8 spacings of depth before the nearest sample
/// Work    twice a sample 8 operations; of those that are seen 150, and 45 for each pixel of the
///         rectangle around a footprint; a sheet 45 a pixel
/// Error   measured by runs. A constant's optical depth ripples as that of project.splat_ewa, by
///         0.0033 for a `sigma` of 0.6
/// Source  Zwicker, Pfister, van Baar, Gross, "EWA volume splatting", IEEE Visualization 2001;
///         Westover 1990
Transition splat_ewa_sheets();

}  // namespace edgewise
