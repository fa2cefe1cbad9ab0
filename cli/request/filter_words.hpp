#pragma once

#include <optional>
#include <string>

#include "cli/request/job_options.hpp"

namespace CLI {
class App;
}

namespace edgewise::cli {

void add_filter(CLI::App& app, JobOptions& options);

/// What --op, --kernel, --border and --slices say, also in words of other programs: `--op gaussian
/// --kernel 2`. @throws RequestError
FilterSpec filter_of(const JobOptions& options);

/// "convolve, correlate, ...": what --op takes.
std::string filter_op_words();

/// The words that say what somebody meant by an option that `filter` does not have, as `--gaussian
/// 2`: "--op convolve --kernel gauss:2"; or "".
/// @param value  what follows the option, if anything does
std::string meant_by_filter_option(const std::string& option, const std::string& value);

}  // namespace edgewise::cli
