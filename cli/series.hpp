#pragma once

#include "cli/request/job_options.hpp"

namespace edgewise::cli {

/// `render` of all time points: a frame for each. @return the exit code
/// @param runs  else the first is planned, and explained
int do_series(const JobOptions& options, bool runs);

}  // namespace edgewise::cli
