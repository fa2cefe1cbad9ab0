#pragma once

#include <memory>

#include "planner/margin.hpp"

namespace edgewise {

struct Session;

/// All paths of a request. What pilots measured of them replaces predictions.
std::unique_ptr<Candidates> candidates_of(const Session& session);

/// Works out how sure the choice is, once there is a plan.
void weigh(Session& session);

}  // namespace edgewise
