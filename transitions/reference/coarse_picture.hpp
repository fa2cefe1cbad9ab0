#pragma once

#include <vector>

#include "transitions/reference/field.hpp"
#include "transitions/reference/statistics.hpp"
#include "transitions/reference/view_geometry.hpp"

namespace edgewise {

/// Pixels where the reference is likely to be largest and smallest: those of a coarse picture
/// (nearest samples, long steps, a thousand rays over some views), and for MIPs those that show the
/// largest sample.
std::vector<OutputSample> likely_extremes(const Request& want, const ReferenceField& field,
                                          const ViewGeometry& geometry,
                                          const Statistics& statistics);

}  // namespace edgewise
