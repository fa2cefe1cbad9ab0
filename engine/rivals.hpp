#pragma once

#include <memory>

#include "planner/margin.hpp"

namespace edgewise {

struct Planned;

/// All paths of a request. What pilots measured of them replaces predictions.
std::unique_ptr<Candidates> candidates_of(const Planned& planned);

/// Works out how sure the choice is, where there is a plan.
void weigh(Planned& planned);

}  // namespace edgewise
