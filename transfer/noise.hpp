#pragma once

#include <optional>

#include "graph/data.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// The standard deviation of noise that is independent from sample to sample [value], from a few
/// drawn places, in about a fifth of a millisecond; nothing where too few of them are bright
/// enough.
///
/// At each the second differences along all three axes are taken one after another, of which plane
/// and straight edges leave nothing; the median of what is left does not see the few places that
/// are corners. Source: Immerkaer, "Fast noise variance estimation", CVIU 64(2), 1996, in 3D.
/// @param least  all 27 samples are at least that: of MR the noise of the dark background is
/// smaller
std::optional<double> noise_of(const Data& data, const Statistics& statistics, double least);

/// Whether noise so large turns normals so far that it is seen on a surface that a preset for MR
/// shows.
/// @param share  standard deviation over the width of the preset's window
bool turns_normals(double share) noexcept;

}  // namespace edgewise
