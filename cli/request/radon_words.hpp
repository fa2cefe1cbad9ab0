#pragma once

#include "cli/request/job_options.hpp"

namespace CLI {
class App;
}

namespace edgewise::cli {

/// What `radon` takes beside what all jobs do.
void add_radon(CLI::App& app, JobOptions& options);
/// @throws RequestError
RadonSetting radon_of(const JobOptions& options);

}  // namespace edgewise::cli
