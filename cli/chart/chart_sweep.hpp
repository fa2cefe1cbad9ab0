#pragma once

#include <string>
#include <vector>

#include "cli/request/job_options.hpp"

namespace edgewise::cli {

/// --sweep OPTION[.x|.y|.z]=FROM:TO:STEP: one request a value of a numeric option.
struct Sweep {
    std::string option;          // as it was typed: "rotate.z", "frames"
    std::vector<double> values;  // FROM, FROM + STEP, ... up to TO

    /// The request with the option at a value. A part of an option (rotate.z) leaves its other
    /// parts as the request has them, in its place among the geometry; else it comes last.
    /// @throws RequestError
    JobOptions at(const JobOptions& options, double value) const;
};

/// @throws RequestError for what cannot be swept, with what can
Sweep sweep_of(const std::string& text);

}  // namespace edgewise::cli
