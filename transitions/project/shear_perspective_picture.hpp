#pragma once

#include <map>
#include <optional>
#include <string>

#include "graph/transition.hpp"
#include "transitions/project/sliced_runs.hpp"

namespace edgewise {

// What is alike in project.shear_warp_perspective and project.shear_warp_perspective_runs.

/// Filter and density of a picture.
std::map<std::string, Domain> perspective_parameters();
Offer perspective_offer(const Representation& from, const Ask& ask, const Parameters& with);
/// @param added  the share of the samples that runs leave to add; nothing: all are added
Work perspective_work(const Offer& offer, const Ask& ask, int view,
                      const std::optional<double>& added = {});
Partition perspective_parts(const Offer& offer, const Ask& ask);
/// @param runs  of visible cells; null: all samples are added
void perspective_picture(const Offer& offer, const Ask& ask, const Data& in, Data& out,
                         const Region& region, Context& context, const RunsOfAxes* runs);

}  // namespace edgewise
