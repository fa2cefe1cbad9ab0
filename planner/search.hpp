#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "graph/transform_graph.hpp"
#include "planner/cost.hpp"

namespace edgewise {

/// A path as the arcs of the transform graph that it takes, in order. Empty: a source is a target.
struct Route {
    Graph::vertex_descriptor source{};
    std::vector<Graph::edge_descriptor> arcs;
    Label label;
};

struct Alike;

/// The transform graph with a cost on every arc: what searches walk.
struct Priced {
    const TransformGraph& spanned;
    const std::vector<Source>& sources;
    std::vector<StepCost> costs;  // by edge_index
    double pinned = 0;
    std::shared_ptr<const Alike> alike = {};  // where Budget::like is set

    const StepCost& cost(Graph::edge_descriptor arc) const;
    Label start(Graph::vertex_descriptor source) const;
    Label step(const Label& label, Graph::edge_descriptor arc) const;
};

/// All routes that no other dominates, in the order of `before`; one route for equal labels.
/// None takes an arc that is barred.
std::vector<Route> pareto_routes(const Priced& priced);

/// The route of least seconds by arcs that are not barred (Dijkstra), or none. Ties go to
/// the first in the order of `before`. Peak and error are no sums along edges, so whether it keeps
/// budgets is seen at its end.
std::optional<Route> fastest_route(const Priced& priced);

/// Every simple route, depth first; at most `limit`.
std::vector<Route> simple_routes(const Priced& priced, std::size_t limit);

}  // namespace edgewise
