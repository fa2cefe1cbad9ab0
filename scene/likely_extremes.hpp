#pragma once

#include <span>
#include <vector>

#include "reference/drawn_pixels.hpp"
#include "scene/statistics.hpp"

namespace edgewise {

/// Pixels where the reference is likely to be largest and smallest. Hill climbing on an estimate
/// of the reference finds them, from neighbour to neighbour; it starts at the most extreme of the
/// `looked` pixels. For MIPs the pixels that show the largest sample are added.
std::vector<OutputSample> likely_extremes(const Request& want, const ReferenceField& field,
                                          const ViewGeometry& geometry,
                                          const Statistics& statistics,
                                          std::span<const DrawnPixels::Looked> looked);

}  // namespace edgewise
