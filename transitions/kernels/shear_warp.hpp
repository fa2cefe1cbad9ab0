#pragma once

#include "transitions/kernels/combine.hpp"

namespace edgewise::kernels {

/// Parallel projection along z of a volume onto an intermediate image whose pixels are as far apart
/// as voxels: pixel (i, j) sees slice k at (i + x + k dx, j + y + k dy). Within a slice the four
/// weights of first-order hold are the same for all pixels, so rows are streamed and nothing is
/// gathered. Along z the samples are the slices themselves. [Lacroute, Levoy 1994]
struct ShearWarp {
    Grid volume;             // one channel; coefficients are not supported
    Hold hold = Hold::foh;   // zoh or foh
    Combining with = {};     // step: length of a ray from slice to slice [t]
    double x = 0, dx = 0;    // [voxel]
    double y = 0, dy = 0;    // [voxel]
    bool backwards = false;  // the last slice is nearest to the eye
};

/// Where each ray of pixels (i, j) .. is inside the volume [slice]; `low` and `high` as in
/// PixelSpans.
void shear_spans(const ShearWarp& warp, std::int64_t i, std::int64_t j, std::int64_t width,
                 std::int64_t height, float* low, float* high, std::ptrdiff_t pitch);

/// Adds all slices to the states of a tile of the intermediate image. A ray that is inside between
/// two slices only gets the sample of the nearest one. Single-threaded, no allocation. Tiles of
/// about 128 x 16 pixels keep states and rows in the first-level cache.
/// @param skip  columns of the tile that are left out; to the bit places hang on where a tile
///              begins, so that a part of it must be asked for in this way
void shear_warp(const ShearWarp& warp, std::int64_t i, std::int64_t j, std::int64_t width,
                std::int64_t height, const PixelSpans& spans, const PixelStates& states,
                std::int64_t skip = 0);

}  // namespace edgewise::kernels
