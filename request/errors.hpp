#pragma once

#include "graph/errors.hpp"

namespace edgewise {

/// No plan serves the request within its budgets.
struct NoPlan : Exception {
    using Exception::Exception;
};

}  // namespace edgewise
