#pragma once

#include <stdexcept>

namespace edgewise {

/// No plan serves the request within its budgets.
struct NoPlan : std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace edgewise
