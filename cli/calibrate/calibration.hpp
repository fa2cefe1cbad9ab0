#pragma once

#include "planner/profile.hpp"

namespace edgewise::cli {

class Messages;

/// Times the edges' own kernels on this machine: every edge with every parameter that planners try,
/// on samples of several types, of sizes within the caches and beyond, on one thread and on all.
/// About 50 s, or 8 where it must be quick.
/// @throws Cancelled
Profile measured_profile(bool quick, Messages& messages);

}  // namespace edgewise::cli
