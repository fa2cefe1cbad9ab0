#pragma once

#include <array>

#include "transitions/kernels/ray_cast.hpp"

namespace edgewise {

/// Integrals along rays of the sum of Gaussians around all centres of a volume, each of volume 1.
/// They are the ray's length inside, but less near the faces, where kernels reach out of the volume
/// and none reaches in. Gaussians are widened across rays by a Gaussian of pixels.
class GaussianSums {
 public:
    /// @param variance  along each axis of index space [voxel^2]
    /// @param low_pass  of pixels [pixel^2]
    GaussianSums(const kernels::Rays& rays, const Extent& volume, double variance, double low_pass);

    /// The integral along a pixel's ray [t]. Ripples of the lattice are left out.
    double along(double px, double py) const;

 private:
    struct Ray;
    /// The standard deviation along an axis at a part of the way to the pixel's plane [voxel].
    double deviation(std::size_t axis, double part) const;
    double at(const Ray& ray, double part) const;

    kernels::Rays rays_;
    Extent volume_;
    double variance_;
    std::array<double, 3> wider_{};     // variance that a pixel adds there [voxel^2]
    std::array<double, 3> greatest_{};  // deviation of any centre
    bool parallel_;
};

}  // namespace edgewise
