#pragma once

#include "cli/request/job_options.hpp"

namespace edgewise::cli {

/// `render --mpr X,Y,Z`: three planes in one picture. @return the exit code
/// @param runs  else it is refused
int do_planes(const JobOptions& options, bool runs);

}  // namespace edgewise::cli
