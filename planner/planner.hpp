#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "graph/transform_graph.hpp"
#include "planner/profile.hpp"

namespace edgewise {

struct PlanOptions {
    Demands demands = {};
    /// Bytes that stay whatever the path: loaded samples, waiting results, what verifying needs.
    double pinned = 0;
    /// Bytes that the process needs at most in addition to what paths count: code, libraries,
    /// stacks.
    double resident = 0;
    /// Bytes that are needed once a path has ended, in addition to what is pinned: for verifying.
    double after = 0;
    /// Bytes that the process is expected to need in addition to what paths count: `resident`
    /// without reserves, for Predicted::expected alone. 0: not known.
    double held = 0;
    /// Whether the front is worked out also where the shortest path is the answer.
    bool front = true;
    /// Replaces costs by seeded random ones, so that tests run paths that would never win.
    std::optional<std::uint64_t> random_costs = {};
};

/// What a plan is compared with where Budget::like is set: the plain path.
struct Compared {
    std::string step;                    // as `--via` takes it
    std::optional<double> seconds = {};  // predicted for all frames; absent: it has no price
    std::optional<double> error = {};    // NRMSE that it is likely to have; absent: nobody looked
};

class PricedGraph;
struct Priced;

/// How the plan was found: as the shortest path in seconds (Dijkstra), which kept all budgets, or
/// among all paths that no other dominates (label setting).
enum class Search { shortest_path, labels };
/// "shortest path" or "label setting".
const char* name_of(Search search) noexcept;

/// What a planner answers: a plan or none, and why.
struct Answer {
    /// The graph that it was read from, for those who want to know more of it.
    std::shared_ptr<const PricedGraph> graph;
    std::optional<Plan> plan;
    Search search = Search::labels;
    /// No path is better in seconds, bytes and error; fastest first. Empty where it was not asked
    /// for (PlanOptions::front).
    std::vector<Plan> front;
    std::vector<Plan> nearest;  // where no plan fits: the closest on either side of the budget
    std::vector<Refusal> refused;
    std::vector<Message> warnings;
    std::optional<Compared> plain;  // absent: nothing is, or no edge offers one
    std::string problem;            // why there is no plan
    int vertices = 0, edges = 0;    // of the transform graph
    double seconds = 0;             // that planning took
};

/// The cheapest path from any of the sources to the request, within its budget.
/// The choice is made for the profile's processors and does not depend on Request::threads, unless
/// those would break a budget in time or memory; the predictions are for these threads.
/// @throws RequestError where a demand makes no sense
Answer plan(const Catalogue& catalogue, const Ask& ask, const std::vector<Source>& sources,
            const Profile& profile, const PlanOptions& options = {});

/// The same from a graph that is there already, made of this question and of options that differ at
/// most in what is reported.
Answer plan(std::shared_ptr<const PricedGraph> graph, const Catalogue& catalogue, const Ask& ask,
            const Profile& profile, const PlanOptions& options);

/// The plan of these steps and no others from a source to the result, or nothing where the graph
/// does not span it.
/// @param steps  as `--via` takes them
std::optional<Plan> plan_of_steps(const PricedGraph& graph, const std::vector<std::string>& steps,
                                  const Catalogue& catalogue, const Ask& ask,
                                  const PlanOptions& options);

/// All simple paths of a priced graph as plans, each label worked out edge by edge: what tests and
/// charts hold the search against. The first `limit` of them in depth-first order.
std::vector<Plan> all_paths(const Priced& priced, const Catalogue& catalogue, const Ask& ask,
                            const PlanOptions& options, std::size_t limit);

}  // namespace edgewise
