#pragma once

#include "request/errors.hpp"

namespace edgewise::cli {

/// What the process ends with.
enum ExitCode { kDone = 0, kFailed = 1, kBadRequest = 2, kNoPlan = 3, kBadInput = 4 };

}  // namespace edgewise::cli
