#pragma once

#include "planner/profile.hpp"

namespace edgewise::cli {

class Messages;

/// Times the edges' own kernels on this machine: every edge with every tried parameter, on samples
/// of several types, within the caches and beyond them, on one thread and on all. About 50 s, or 8.
/// @throws Cancelled
Profile measured_profile(bool quick, Messages& messages);

}  // namespace edgewise::cli
