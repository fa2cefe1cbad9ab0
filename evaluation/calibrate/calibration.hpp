#pragma once

#include "engine/listener.hpp"
#include "graph/transition.hpp"
#include "planner/profile.hpp"

namespace edgewise {

/// Times the edges on this machine: every edge of the catalogue that serves a trial, with every
/// parameter that planners try, on samples of several types, of sizes within the caches and beyond,
/// on one thread and on all. About 70 s, or 8 where it must be quick.
/// @throws Cancelled
Profile measured_profile(const Catalogue& edges, bool quick, Listener& listener);

}  // namespace edgewise
