#pragma once

#include <string>

#include "cli/request/job_options.hpp"

namespace edgewise::cli {

/// Everything that is to be written can be, before any work. @throws RequestError
void check_outputs(const JobOptions& options);

/// Writes a part of the explanation; beside what was asked for on standard output it goes to
/// standard error.
void explain(const JobOptions& options, const std::string& text);

}  // namespace edgewise::cli
