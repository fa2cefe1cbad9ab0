#pragma once

#include <memory>
#include <optional>
#include <string>

#include "engine/looked.hpp"
#include "engine/way_out.hpp"
#include "planner/margin.hpp"
#include "planner/planner.hpp"
#include "request/errors.hpp"

namespace edgewise {

/// The third stage: the graph with its costs, and what the planner makes of it. There need not be a
/// plan.
struct Planned : Looked {
    explicit Planned(Looked looked) : Looked(std::move(looked)) {}

    PlanOptions plan_options;
    ErrorsWanted errors = ErrorsWanted::asked;
    Answer answer;
    /// A plan that the preview shows to be better than the answer's. It is not taken, since the
    /// preview takes longer than it saves: who does not ask for errors draws none, and gets the
    /// answer's. Who asks gets the same.
    std::optional<Plan> seen_better;
    std::optional<Margin> margin;   // of its plan, where somebody asked for it
    std::optional<WayOut> way_out;  // where it has none

    /// What the plan is expected to save over all runs against the plain path [s]; below 0 where it
    /// takes longer. Absent where nothing is compared with, or there is no plan.
    std::optional<double> saved_seconds() const;
    /// What choosing took [s]: planning, without the preset that every path needs.
    double choosing_seconds() const noexcept { return answer.seconds - spent.preset; }

    /// The planned graph that the answer was read from; before there is one, a new one.
    std::shared_ptr<const PricedGraph> graph() const;
};

/// No plan serves the request within its budgets: what would do.
struct Infeasible : NoPlan {
    Infeasible(const Message& what, WayOut ways) : NoPlan(what), way_out(std::move(ways)) {}
    WayOut way_out;
};

/// What the planner is told, as the process is now, with no answer yet.
Planned unplanned(Looked looked, const Effort& effort);

/// Prices the graph and chooses a path: by models, and by a pilot where the request wants one.
/// @throws RequestError, Cancelled
Planned price(Looked looked, const Effort& effort, Listener& messages);

/// The path of another plan for a request that is looked at: its domains, boxes and costs are
/// worked out anew, errors are guesses. Steps that only copy are left out where they have no use
/// here. Where an edge refuses, another path is chosen, and a warning says so.
/// @throws Infeasible, RequestError
Planned follow(Looked looked, const Plan& path, Listener& messages);

/// @throws Infeasible where there is no plan
void expect_plan(const Planned& planned);

/// Takes the errors out of the answer where nobody asked for them: some may be guesses.
void forget_errors(Planned& planned);

/// Bytes that a path finds taken, and that the process has besides, as they are now.
void take_bytes(Planned& planned);

}  // namespace edgewise
