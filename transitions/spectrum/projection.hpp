#pragma once

#include <optional>
#include <string>
#include <vector>

#include "graph/transition.hpp"
#include "transitions/kernels/kaiser_bessel.hpp"

namespace edgewise {

/// The error of a picture by a slice of a spectrum, by window; and what of it comes from the ends
/// of rays.
inline constexpr FactFamily kSpectrumError{"picture/spectrum"};
inline constexpr Fact kSpectrumEnds{"picture/spectrum/ends"};

/// Vertices of the spectrum differ by the window that they were made for: a facet names it.
std::string window_facet(const kernels::KaiserBessel& window);
/// The padding that is planned with unless a path asks for another.
inline constexpr double kTriedPadding = 1.25;
/// The fact that holds the error of pictures by a window [value of the picture].
/// @param box  the transformed box: all of the input, or the part that a crop kept
FactName fact_of_spectrum(const kernels::KaiserBessel& window, const Extent& box,
                          const Request& want);
/// The error of pictures by this window, from a preview; none where it measured none [value].
/// @param from  the transformed samples: the input, or the part that a crop kept
std::optional<double> measured_error(const kernels::KaiserBessel& window,
                                     const Representation& from, const Ask& ask);
/// The window of a spectrum.
kernels::KaiserBessel window_of(const Representation& spectrum);
/// Every window there is.
const std::vector<kernels::KaiserBessel>& windows();
/// "object/spectrum+window4x1.25" ...
std::string spectrum_kind(const kernels::KaiserBessel& window);
/// The content of a spectrum that is stored as its Hartley transform.
inline constexpr const char* kHartley = "hartley";
/// "object/hartley+window4x1.25" ...
std::string hartley_kind(const kernels::KaiserBessel& window);
/// Period of the padded volume that a spectrum is of, in either form [voxel].
Extent spectrum_period(const Representation& spectrum);

/// Why a spectrum cannot give a request's pictures; empty where it can.
std::string no_projection(const Ask& ask);

/// A ray that meets less of the volume than this [step of screen z] divides ghosts by almost
/// nothing. So the excess of its mean over the commonest value is divided by this length instead,
/// which draws the pixel towards that value: a bright face may be lost there, but no ghost
/// dominates.
inline constexpr double kShortestRay = 1;

/// Length of the longest ray within the volume, of all views [file unit]; they are parallel.
double longest_ray(const Request& want);

/// Period of the pictures of all views [pixel], x even: in it no repetition of the volume reaches a
/// picture.
Extent picture_period_of(const Request& want);

}  // namespace edgewise
