#pragma once

#include <cstdint>

#include "graph/data.hpp"
#include "graph/request.hpp"
#include "transitions/kernels/shear_warp.hpp"

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

/// What the kernels are told of it. All must stay alive.
kernels::ShearWarp shear_warp_of(const ShearView& f, const Data& in, const Request& want,
                                 const kernels::Optics& optics, kernels::Hold hold);

/// The box of the image that a box of the picture is read from.
Region box_of_image(const ShearView& f, const Region& picture);

/// From the multiple of `each` at or before it: tiles begin there.
Region from_multiple(Region box, std::int64_t each);

}  // namespace edgewise
