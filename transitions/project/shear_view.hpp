#pragma once

#include <cstdint>

#include "graph/request.hpp"
#include "transitions/kernels/grid.hpp"

namespace edgewise {

/// One view, factored into shears and a warp: intermediate pixel (i, j) is the ray through (i + x,
/// j + y) of slice 0. In the slice nearest to the eye, which hides the others, these are places of
/// samples.
struct ShearView {
    double x = 0, dx = 0, y = 0, dy = 0;  // as in kernels::ShearWarp [voxel]
    double step = 1;                      // from slice to slice [t]
    bool backwards = false;
    Extent image;                // of the intermediate image
    kernels::Affine to_image{};  // pixel -> intermediate pixel
};

/// Of samples whose z is the axis along which rays advance fastest.
ShearView shear_view_of(const Representation& from, const Request& want, int view);

/// The box of the image that a box of the picture is read from.
Region box_of_image(const ShearView& f, const Region& picture);

/// From the multiple of `each` at or before it: tiles begin there.
Region from_multiple(Region box, std::int64_t each);

}  // namespace edgewise
