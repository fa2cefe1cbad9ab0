#pragma once

#include <array>

#include "reference/field.hpp"
#include "reference/preview_holds.hpp"
#include "reference/view_geometry.hpp"

namespace edgewise {

/// Estimated errors of one ray: differences of cheap casts through the stored numbers, without
/// lattices and blocks, from an estimate of the reference. They take about a tenth of the time of
/// exact errors, and correlate with them (r^2 of 0.8 to 0.99 for most, 16 pictures of 8 volumes).
struct RayLook {
    // By hold and step; and by slices, along a parallel ray that is moved to meet samples in one of
    // them, as shear-warp without interpolation has it.
    enum Cast : std::size_t { kZoh1, kZoh2, kFoh1, kFoh2, kSlices, kCasts };

    std::array<double, kCasts> squares{};  // as errors of pictures; 0 where none is finite
    // Of modes with a threshold: Threshold::margin of each cast, and of the guess; else NaN.
    std::array<double, kCasts> margins{};
    double margin = 0;
    double jump = 0;           // the square of two different answers
    double low = 0, high = 0;  // of the guess, over its channels; low > high: nothing
    bool seen() const noexcept { return low <= high; }
};

/// The estimate reads the reference's own field. In place of the spline through the samples it has
/// Keys's cubic convolution, which comes close with four samples along each axis.
///
/// Keys, "Cubic convolution interpolation for digital image processing", IEEE Trans. Acoustics,
/// Speech, and Signal Processing 29(6), 1981.
RayLook look_at(const RaySpan& ray, const Request& want, const ReferenceField& field);

/// The guess alone, as edges deliver it: one value, or premultiplied red, green, blue and opacity.
std::array<double, 4> guess_at(const RaySpan& ray, const Request& want,
                               const ReferenceField& field);

/// The same at places: channel 0 as nearest, linear and guessed.
struct PointLook {
    std::array<double, Places::kMost> nearest, linear, guess;
};
void look_at(const Places& places, const ReferenceField& field, PointLook& look);

}  // namespace edgewise
