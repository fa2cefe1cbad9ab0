#pragma once

#include <string>
#include <vector>

#include "cli/request/job_options.hpp"
#include "engine/merge.hpp"

namespace edgewise::cli {

/// Whether --channel asks for a picture in colours: several channels, one with a colour, or all.
bool names_colours(const JobOptions& options);

/// --channel 0,1 or 0=red,2=#00ff80; none of "all". @throws RequestError
std::vector<ChannelSpec> channels_of(const std::string& text);

}  // namespace edgewise::cli
