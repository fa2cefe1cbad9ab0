#pragma once

#include <string>

#include "graph/transition.hpp"

namespace edgewise {

// A slice tells what a ray adds up and how long it is inside, and nothing else. For any mode that
// asks for no more, the pixel is that of a ray through one uniform medium with the same sum.

/// The pixel of a ray in f64, by the mode's own form.
/// @param sum     of the field, not less zero [value x step of screen z]
/// @param length  inside the volume [step of screen z]; 0: the ray misses
double pixel_of_sum(const Request& want, double sum, double length);

/// Whether twice the ray makes twice the pixel: an X-ray, and no mean or radiograph.
bool grows_with_length(const Request& want);

/// The most that a pixel changes by over what its sum changes by, for values from low to high, of a
/// mode that is steepest where rays begin, as exp(-x) is [value of the picture / (value x step)].
double steepness(const Request& want, double low, double high);

/// Why pixels do not follow from sums of the data's values; empty where they do. A mode may cut
/// values off, as a radiograph does below air: then sums must not hold any.
std::string no_pixel_of_sum(const Request& want, const Scene& scene);

}  // namespace edgewise
