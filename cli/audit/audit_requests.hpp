#pragma once

#include <string>
#include <vector>

#include "cli/audit/audit.hpp"
#include "cli/request/job_options.hpp"

namespace edgewise::cli {

/// Reads {"requests": [{"args": ["render", ...], "name": "", "held_out": true}]}.
/// @throws InputError naming the file and the field
std::vector<AuditRequest> load_audit_requests(const std::string& file);

/// The arguments of `warp`, `render` or `filter`, as the command line would read them. What says
/// where to write is dropped: an audit writes no pictures. @throws RequestError
JobOptions job_options_of(const AuditRequest& request);

}  // namespace edgewise::cli
