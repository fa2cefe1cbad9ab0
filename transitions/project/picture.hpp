#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>

#include "graph/transition.hpp"
#include "transitions/filters/filter.hpp"
#include "transitions/kernels/combine.hpp"
#include "transitions/kernels/ray_cast.hpp"
#include "transitions/kernels/ray_light.hpp"
#include "transitions/kernels/ray_table.hpp"

namespace edgewise {

// What the edges that end in a picture share. t is a length along a ray in units (Request::unit):
// screen z of parallel rays, the distance from the eye in perspective.

/// Why no picture can be made of a representation, whatever the algorithm; empty: it can.
std::string no_picture(const Representation& from, const Ask& ask);

/// Why no picture can be combined slice by slice, with samples of one slice at a time; empty: it
/// can.
std::string no_slices(const Request& want);

/// Samples as the kernels of a mode get them, see ModeTraits::negated.
kernels::Grid rule_grid(const Data& in, const Request& want);
/// How the kernels combine stored numbers for a request; the step is 1. Optics must stay alive.
kernels::Combining combining_of(const Request& want, const ValueMap& values,
                                const kernels::Optics& optics);
/// What a ray that meets nothing has there.
double rule_miss(const Request& want) noexcept;
/// What the kernels made gets its sign back. @param row  floats from one row to the next
void give_sign(const Request& want, float* first, std::int64_t width, std::int64_t height,
               std::ptrdiff_t row) noexcept;
/// Optics for stored numbers, with opacities per length in t.
kernels::Optics optics_of(const Request& want, const ValueMap& values);

/// Rays of a view as lines of indices of samples that lie like `from`; t counts from screen z =
/// front (parallel) or from the eye.
kernels::Rays rays_of(const Representation& from, const Request& want, int view, double front = 0);

/// What rays of a view see of samples that lie like `from`; nothing where that is all of them.
std::optional<kernels::Kept> kept_of(const Representation& from, const Request& want, int view);

/// Mean length of rays inside the data over all pixels of a view [t], misses counting 0; exact
/// where the screen shows all of them, else from a lattice of rays.
double mean_length(const Representation& from, const Request& want, int view);

/// What parallel rays of a view meet of the data: each by itself, and in packets of `side` x `side`
/// neighbours, of which all go on while one is inside. Means over how packets lie, of convex data
/// on a screen that shows all of them; of another screen as much less as it has fewer rays that
/// hit.
struct RaysMet {
    double rays = 0;     // pixels whose rays meet data
    double packets = 0;  // pixels of packets that have such rays
    double beyond = 0;   // [t], of all lanes: lengths that packets go, less those of rays in data
    double ragged = 0;   // of these, where some of the rays that meet data begin or end
};
/// From an eye at a finite distance all pixels see data, and no packet goes beyond its rays.
RaysMet rays_met(const Representation& from, const Request& want, int view, int side);

/// A logarithm and an exponential, for opacities over another length than theirs. Samples that are
/// transparent or hidden need none, see measure_casting().
inline constexpr double kCorrectionOperations = 60;

/// A ray ends where so little is left to see: far below half of an 8-bit step.
inline constexpr double kTerminated = 1.0 / 4096;

/// Steps that casts are measured with, in order; of others the error is told from these.
inline constexpr std::array<double, 4> kCastSteps = {0.25, 0.5, 1, 2};

// Errors of pictures and gains of what came before, measured on the preview (Scene::facts), else
// guesses.

/// Of rays cast through samples with a hold (zoh, foh, bspline3) and a step [t].
Error cast_error(const Filter& filter, double step, const Ask& ask);
/// Of slices sheared onto an intermediate image, `step` apart [t], and that image warped.
Error sheared_error(const Filter& filter, double step, const Ask& ask);
/// Of samples in screen space, one a unit, combined along z.
Error combined_error(const Ask& ask);

/// Tiles of a region of a picture, in parallel. Polls before each. @throws Cancelled
void for_tiles(const Region& region, std::int64_t width, std::int64_t height,
               const Context& context, const std::function<void(const Region&)>& body);
/// The same. The body is not copied, so that nothing is allocated for it.
template <class Body>
void for_tiles(const Region& region, std::int64_t width, std::int64_t height,
               const Context& context, const Body& body) {
    for_tiles(region, width, height, context, std::function<void(const Region&)>(std::cref(body)));
}

/// What lights the samples of a view of `from`; nothing where light falls on none.
std::optional<kernels::RayLight> light_of(const Representation& from, const Request& want,
                                          int view);
/// Opacities by the length of gradients of `from`; nothing where they are by value alone.
std::optional<kernels::RayEdges> edges_of(const Representation& from, const Request& want,
                                          int view);
/// Opacities and colours by values and gradients of `from`; nothing where there is no table.
std::optional<kernels::RayTable> table_of(const Representation& from, const Request& want,
                                          int view);
/// How light falls off along the rays that rays_of() gives for `front`.
std::optional<kernels::RayCue> cue_of(const Request& want, int view, double front);

}  // namespace edgewise
