#pragma once

#include <functional>
#include <string>

#include "graph/transition.hpp"
#include "transitions/kernels/combine.hpp"

namespace edgewise {

// What the edges that end in a picture share. t is a length along a ray in units (Request::unit):
// screen z of parallel rays, the distance from the eye in perspective.

/// Why no picture can be made of a representation, whatever the algorithm; empty: it can.
std::string no_picture(const Representation& from, const Ask& ask);

kernels::Combine combine_of(Mode mode) noexcept;
/// Optics for stored numbers, with opacities per length in t.
kernels::Optics optics_of(const Request& want, const ValueMap& values);

/// Rays of a view as lines of indices of samples that lie like `from`; t counts from screen z =
/// front (parallel) or from the eye.
kernels::Rays rays_of(const Representation& from, const Request& want, int view, double front = 0);

/// Mean length of rays inside the data over all pixels of a view [t], misses counting 0; from a
/// lattice of rays.
double mean_length(const Representation& from, const Request& want, int view);

/// What the samples on the way to a picture do to its error.
struct PictureError {
    std::string filter;  // as they were cast: zoh, foh, bspline3
    double step = 1;     // [t]
};
/// Errors of a picture measured on the preview (Scene::facts), else guesses; gains the same.
Error picture_error(const PictureError& cast, const Ask& ask);
/// The filter whose samples are the field that the request asks for.
std::string exact_filter(Field field);

/// Tiles of a region of a picture, in parallel. Polls before each. @throws Cancelled
void for_tiles(const Region& region, std::int64_t width, std::int64_t height,
               const Context& context, const std::function<void(const Region&)>& body);

}  // namespace edgewise
