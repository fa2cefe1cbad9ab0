#pragma once

#include <stdexcept>

namespace edgewise::cli {

/// What the process ends with.
enum ExitCode { kDone = 0, kFailed = 1, kBadRequest = 2, kNoPlan = 3, kBadInput = 4 };

/// No plan serves the request within its budgets: exit code 3.
struct NoPlan : std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace edgewise::cli
