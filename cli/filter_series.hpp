#pragma once

#include "cli/request/job_options.hpp"

namespace edgewise::cli {

/// Every time point of a series by itself, in one file that is a series again (NIfTI, NRRD).
/// @return the exit code
int do_filter_series(const JobOptions& options);

}  // namespace edgewise::cli
