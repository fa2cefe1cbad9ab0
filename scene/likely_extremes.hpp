#pragma once

#include <span>
#include <vector>

#include "reference/drawn_pixels.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// Pixels where the reference is likely to be largest and smallest: where the guess of it is, of
/// those that were looked at, and from there to the end of its slope from neighbour to neighbour;
/// and for MIPs those that show the largest sample.
std::vector<OutputSample> likely_extremes(const Request& want, const ReferenceField& field,
                                          const ViewGeometry& geometry,
                                          const Statistics& statistics,
                                          std::span<const DrawnPixels::Looked> looked);

}  // namespace edgewise
