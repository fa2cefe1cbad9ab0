#pragma once

#include "cli/request/job_options.hpp"

namespace edgewise::cli {

/// `render` of several channels into one picture. @return the exit code
/// @param runs  else they are only planned, and explained
int do_merge(const JobOptions& options, bool runs);

}  // namespace edgewise::cli
