#pragma once

#include <optional>

#include "planner/planner.hpp"

namespace edgewise {

/// The same plan with its last steps run box by box (Plan::boxes): less memory for more seconds,
/// since neighbouring boxes read the same samples around their faces, and make them twice. None
/// where there is nothing between the last steps.
std::optional<Plan> boxed(const Plan& whole, const Ask& ask, int boxes, const PlanOptions& options);

/// The plan with the fewest boxes, of 2, 4, 8 ..., that keeps all budgets; none where none does.
std::optional<Plan> fewest_boxes(const Plan& whole, const Ask& ask, const PlanOptions& options);

}  // namespace edgewise
