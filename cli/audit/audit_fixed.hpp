#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "cli/audit/audit.hpp"

namespace edgewise::cli {

/// What there is without a planner: one path for all requests of a family (job, dimensions or
/// mode), the one that turns out best. Where it is not offered or breaks a budget, a request counts
/// with its most accurate path: what someone takes whose usual path will not do.
nlohmann::ordered_json fixed_paths(const std::vector<const AuditedRequest*>& requests);

/// The rules by which other libraries choose, as the paths here that do the same work, timed here:
/// what a planner is worth to those who know them. A request that a library does not serve is not
/// counted; one that its path breaks a budget of counts as in fixed_paths().
///  - SciPy, `ndimage.affine_transform`: always the cubic B-spline, prefiltered. Warps.
///  - OpenCV, `warpAffine`: always linear. Warps of images.
///  - VTK, its volume mappers as its examples set them up: trilinear, a sample
///    every spacing. Renders.
nlohmann::ordered_json rules_of_others(const std::vector<const AuditedRequest*>& requests);

}  // namespace edgewise::cli
