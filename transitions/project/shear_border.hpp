#pragma once

#include <memory_resource>

#include "graph/mode.hpp"
#include "transitions/kernels/backward.hpp"
#include "transitions/kernels/shear_warp.hpp"

namespace edgewise {

/// The intermediate image of a shear-warp and how the picture lies on it.
struct ShearedImage {
    Mode mode;
    const kernels::ShearWarp& warp;
    float* values = nullptr;  // of the box held, channels interleaved
    Extent extent;
    Region held;
    int channels = 1;
    kernels::Affine to_image{};  // pixel -> pixel of the intermediate image
    float outside = 0;           // of pixels whose rays miss the volume

    float* at(std::int64_t i, std::int64_t j) const {
        return values + ((j - held.begin[1]) * held.extent().x + i - held.begin[0]) * channels;
    }
};

// Beyond the faces of the volume the intermediate image has no values, but pixels of the picture
// whose rays are inside by less than half a voxel lie between such places and the outermost values.
// As everywhere else the nearest sample continues there, up to half a spacing.

/// Continues the image from the pixels whose rays meet the volume to all others: what reads more
/// than the four neighbours of a place, as splines do, sees no step. All of it must be held.
void continue_image(const ShearedImage& image, std::pmr::memory_resource* memory);

/// How a picture was read from the image.
enum class Read {
    bilinear,   // from four neighbours
    nearest,    // from the nearest pixel
    continued,  // from a continued image: right but for the rays that miss
};

/// Corrects a picture where reading the image alone does not tell: pixels whose rays miss the
/// volume get `outside`, and for others only those neighbours count whose rays meet it (of which
/// there is always one). Bilinear integrals are those of the ray's own length where the lengths of
/// rays inside are no linear function of the place; so is one that has no other than a farther
/// neighbour.
/// @param tile  that the part lies in: each of its rows is cut into pieces as a whole, so that
/// every
///              part of it becomes the same to the bit
void mend_border(const ShearedImage& image, Read read, const kernels::WarpOutput& picture,
                 const Region& part, const Region& tile);

}  // namespace edgewise
