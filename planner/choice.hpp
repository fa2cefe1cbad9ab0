#pragma once

#include <vector>

#include "planner/planner.hpp"
#include "planner/search.hpp"

namespace edgewise {

/// Costs of all arcs of a spanned graph, by edge_index.
std::vector<StepCost> price(const TransformGraph& spanned, const Catalogue& catalogue,
                            const Ask& ask, const Profile& profile, int threads,
                            const PlanOptions& options);

/// What a route is expected to take.
Predicted predicted_of(const Route& route, const Priced& priced, const Ask& ask,
                       const PlanOptions& options);
/// A route with all that is known of its steps.
Plan plan_of(const Route& route, const Priced& priced, const Catalogue& catalogue, const Ask& ask,
             const PlanOptions& options);

bool accurate_enough(const Predicted& predicted, const Budget& budget);
bool fast_enough(const Predicted& predicted, const Budget& budget);
bool small_enough(const Predicted& predicted, const Budget& budget);
/// Whether all budgets are kept.
bool feasible(const Predicted& predicted, const Budget& budget);

/// What is minimised; an unknown error is worse than any known one.
double objective(const Predicted& predicted, Minimize what);

}  // namespace edgewise
