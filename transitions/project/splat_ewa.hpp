#pragma once

#include "graph/transition.hpp"

namespace edgewise {

/// Splatting by elliptical Gaussians (elliptical weighted average): each sample adds a Gaussian,
/// whose ellipse is the projection of its kernel at the voxel. From an eye at a finite
/// distance footprints differ by voxel; voxels smaller than pixels are widened to pixels, so that
/// nothing aliases. Samples of the commonest value are passed over, as in project.splat.
///
/// The kernel is a Gaussian of standard deviation `sigma` voxels. Kernels add up to
/// 1 within (1 + 2 exp(-2 (pi sigma)^2))^2 - 1 in any view: 0.0033 for 0.6. That is the ripple of a
/// constant's integral; the low-pass filter of the pixel (a Gaussian of `lowpass` pixels) leaves
/// less of it. Near the faces of the data, where kernels of all voxels add up to less along a ray,
/// what is left of them stands for all of the ray's length inside.
/// Edge    object/scalar -> screen/picture
/// Shape   [nz, ny, nx], x fastest, any real type; one f32 a pixel
/// Needs   integrals or means, finite samples, all in one memory; an eye, where there is one, at
///         least 8 spacings of depth before the nearest sample
/// Work    an operation a voxel; of those that are not empty 90, and 30 for each pixel of the
///         rectangle around a footprint; 4000 for each pixel that has any beside an edge of the
///         data, 200 for others
/// Error   not known to plans. Blur is at most about that of casting with first-order hold, times
///         the variance of kernel and pixel over that of the trilinear kernel (1/6). An ellipse is
///         that of parallel rays: at a ray that is r standard deviations away, a kernel of depth Z
///         whose deviation in depth is s errs by at most a share of s / Z r (r^2 + 2) to first
///         order, so by 2.1 s / Z of its peak. Errors to either side cancel where voxels are alike.
/// Source  Zwicker, Pfister, van Baar, Gross, "EWA volume splatting", IEEE Visualization 2001;
///         Mueller and Yagel, "Fast perspective volume rendering with splatting", 1996
Transition splat_ewa();

}  // namespace edgewise
