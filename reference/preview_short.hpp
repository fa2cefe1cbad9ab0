#pragma once

#include <array>
#include <vector>

#include "reference/drawn_pixels.hpp"

namespace edgewise {

/// Pixels at the silhouette of the input: rays that cut off an edge or a corner, or that
/// run along a face within a sample or two of it. There a spectrum, which knows no faces, is worst,
/// an intermediate image is read across the silhouette, screen samples lie on neither side of a ray
/// that is shorter than their distance, and a mean divides what is wrong along a ray by the ray's
/// length. These few pixels carry most of the error of a picture, and some hundred
/// rays drawn from all are likely to miss them.
struct ShortRays {
    static constexpr std::size_t kClasses = 2;
    std::array<DrawnPixels, kClasses> classes;

    /// The class that a ray belongs to; kClasses: none. 0: next to no length.
    static std::size_t class_of(const RaySpan& ray, const Request& want) noexcept;
};

ShortRays draw_short_rays(const Request& want, const ReferenceField& field,
                          const ViewGeometry& geometry, double times = 1);

}  // namespace edgewise
