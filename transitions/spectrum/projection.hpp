#pragma once

#include <optional>
#include <string>
#include <vector>

#include "graph/transition.hpp"
#include "transitions/kernels/kaiser_bessel.hpp"

namespace edgewise {

/// Vertices of the spectrum differ by the window that they were made for: a facet names it.
std::string window_facet(const kernels::KaiserBessel& window);
/// What a preview measured that pictures by this window get wrong, all in all [value].
/// @param from  what is transformed: the input, or what store.crop leaves of it
std::optional<double> measured_error(const kernels::KaiserBessel& window,
                                     const Representation& from, const Ask& ask);
/// The window of a spectrum.
kernels::KaiserBessel window_of(const Representation& spectrum);
/// Every window there is.
const std::vector<kernels::KaiserBessel>& windows();
/// "object/spectrum+window4x1.25" ...
std::string spectrum_kind(const kernels::KaiserBessel& window);

/// Why a request's pictures are no projections that a spectrum gives; empty where they are.
std::string no_projection(const Ask& ask);

/// Period of the pictures of all views [pixel], x even: in it no repetition of the volume reaches a
/// picture.
Extent picture_period_of(const Request& want);

}  // namespace edgewise
